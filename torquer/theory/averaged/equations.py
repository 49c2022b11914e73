"""Closed averaged equations and first integrals in plain text; ' is d/du."""

SHARED = "p = sin^2(Theta)/2, q = 1 - 2p; rho and sigma of the momentum from the cone axis Z3"
SMALL = {
    "bdot": "k B0^2/(omega0 C)",
    "nutation_damping": "k B0^2/(omega0 A)",
    "spin_up": "k B0^2/(omega0 L0)",
    "reorientation": "k B0^2/omega0",
    "preliminary_1": "k B0^2/(omega0 L0)",
    "preliminary_2": "k B0^2/(omega0 L0)",
    "sdot": "k B0/(omega0 C)",
}
UNITS = {
    "bdot": "A m^2 s/T",
    "nutation_damping": "A m^2 s/T",
    "spin_up": "A m^2/T",
    "reorientation": "A m^2/(N m s T)",
    "preliminary_1": "A m^2/T",
    "preliminary_2": "A m^2/T",
    "sdot": "A m^2 s",
}
#: Abbreviations first, then l', rho', sigma', theta' (and of S-dot c', c = cos gamma).
EQUATIONS = {
    "bdot": (
        "g = cos^2 theta + (C/A) sin^2 theta",
        "l' = -eps l (2p + (1 - 3p) sin^2 rho) g",
        "rho' = eps (3p - 1) sin rho cos rho g",
        "sigma' = 0",
        "theta' = (eps/2) (1 - C/A) (2 - 2p - (1 - 3p) sin^2 rho) sin theta cos theta",
    ),
    "nutation_damping": (
        "h = 2p + (1 - 3p) sin^2 rho",
        "l' = -(eps/2) l h sin^2 theta",
        "rho' = (eps/2) (3p - 1) sin rho cos rho sin^2 theta",
        "sigma' = 0",
        "theta' = -(eps/2) h sin theta cos theta",
    ),
    "spin_up": (
        "h = 2p + (1 - 3p) sin^2 rho",
        "l' = eps h cos theta",
        "rho' = (eps/l) (1 - 3p) sin rho cos rho cos theta",
        "sigma' = 0",
        "theta' = -(eps/(2l)) (2 - h) sin theta",
    ),
    "reorientation": (
        "a = cos rho (L1 cos sigma + L2 sin sigma) - L3 sin rho",
        "b = L2 cos sigma - L1 sin sigma",
        "l' = 0",
        "rho' = eps p a/l",
        "sigma' = eps (p cos^2 rho + q sin^2 rho) b/(l sin rho)",
        "theta' = 0",
    ),
    "preliminary_1": (
        "l' = eps p cos rho sin^2 theta",
        "rho' = -(eps/l) p (1 - sin^2 theta/2) sin rho",
        "sigma' = 0",
        "theta' = (eps/l) p sin theta cos theta cos rho",
    ),
    "preliminary_2": (
        "h = 2p + (1 - 3p) sin^2 rho",
        "l' = eps sin^2 theta (p cos rho - h/2)",
        "rho' = (eps/l) ((3p - 1) sin rho cos rho sin^2 theta/2 - p (1 - sin^2 theta/2) sin rho)",
        "sigma' = 0",
        "theta' = (eps/l) sin theta cos theta (p cos rho - h/2)",
    ),
    "sdot": (
        "c = sin rho (S1 cos sigma + S2 sin sigma) + S3 cos rho",
        "d = p c + (q - p) S3 cos rho",
        "a = p + (q - p) S3^2",
        "g = cos^2 theta + (C/A) sin^2 theta",
        "l' = -eps l g (a - c d)",
        "rho' = eps g d (c cos rho - S3)/sin rho",
        "sigma' = eps g d (S2 cos sigma - S1 sin sigma)/sin rho",
        "theta' = (eps/2) (1 - C/A) (a + c d) sin theta cos theta",
        "c' = eps g d (1 - c^2)",
    ),
}
_LENGTH = "(3p - 1) (ln l + ln cos rho) + 2p ln tan rho"
_SPIN = "l cos theta"
INTEGRALS = {
    "bdot": {
        "length": _LENGTH,
        "nutation": "(1 - C/A)/2 (2 (1 - p) ln tan rho - (3p - 1) ln cos rho) "
        "- (3p - 1) (ln sin theta - (C/A) ln cos theta)",
    },
    "nutation_damping": {
        "spin": _SPIN,
        "path": "2p ln tan rho + (3p - 1) (ln cos rho - ln cos theta)",
    },
    "spin_up": {
        "length": _LENGTH,
        "nutation": "(1 - 3p) (ln sin theta + ln cos rho/2) + (1 - p) ln tan rho",
    },
    "reorientation": {"node": "sin rho sin sigma / |cos rho|^(q/p), for a target along Z1 alone"},
    "preliminary_1": {
        "spin": _SPIN,
        "path": "-ln cos theta/2 - ln tan theta - ln sin rho",
    },
    "preliminary_2": {"spin": _SPIN},
    "sdot": {
        "plane": "(cos rho - S3 c)/(1 - c^2)^0.5",
        "length": "l |d|",
        "nutation": "(1 - C/A)/2 (ln(1 - c^2) - ln|d|) + ln sin theta - (C/A) ln cos theta",
    },
}
#: Laws with closed averaged equations.
LAWS = tuple(EQUATIONS)
