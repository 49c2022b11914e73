"""Published figures and tables that the gallery is to show: ids, content, expected as printed."""

import difflib
from dataclasses import dataclass

#: What each key stands for.
SOURCES = {
    "FIELD": "Pichuzhkina, Roldugin: geomagnetic field models for satellite angular motion",
    "MAG": "Dissertation: magnetic attitude control of small satellites",
    "SDOT": "Karpenko, dissertation 2020: the S-dot law and the on-board software of Chibis-M",
    "WHEEL": "J. Comput. Syst. Sci. Int. 2022 No 1: wheel arrays of four and six",
    "MGS": "Algorithm of the magneto-gyroscopic attitude control of Meteor-M",
}


@dataclass(frozen=True)
class Row:
    """A row of the catalogue: one or more published figures or tables."""

    ids: tuple[str, ...]
    content: str
    expected: str = ""

    @property
    def source(self) -> str:
        """Key of the source."""
        return self.ids[0].split("-", 1)[0]


def _row(source: str, numbers: str, content: str, expected: str = "") -> Row:
    return Row(tuple(f"{source}-{n}" for n in numbers.split()), content, expected)


ROWS = (
    _row("FIELD", "3", "B0 arithmetic vs integral mean vs inclination, 350 km",
         "difference <= ~1250 nT, ~3 %"),
    Row(("FIELD-5", "MAG-1.2.2"), "Greatest deviation of the direct dipole from the cone vs i",
        "maximum near 52 deg"),
    _row("MAG", "1.2.3", "Deviation from the cone along the orbit at that i"),
    _row("FIELD", "6", "Greatest angle between direct-dipole and averaged vectors vs i",
         "plateau ~19 deg above 35 deg"),
    _row("MAG", "1.2.4 1.2.5", "Theta(i), Theta - i", "<= ~10 deg"),
    _row("FIELD", "mathieu", "First instability tongue, averaged and direct dipole",
         "edges 1 +- eps/2 + 7/32 eps^2 form; tongue vanishes at other parameter for the dipole"),
    _row("FIELD", "2.16", "Pitch offset with B-dot: dipole vs averaged, polar", "ratio 8/9"),
    _row("FIELD", "8", "Damping under 4 models", "similar times; IGRF slightly worse"),
    _row("FIELD", "9", "Pitch-wheel axis to the orbit normal, 4 models", "same"),
    _row("FIELD", "10 11", "Accuracy with disturbances, without/with wheel", "similar"),
    _row("FIELD", "cost", "Relative cost of the 4 models", "147.7 : 33.8 : 15 : 14.8 s"),
    _row("FIELD", "table", "Recommendation table"),
    _row("MAG", "2.1.1", "l(u), sphere, several i"),
    _row("MAG", "2.1.2 2.1.3", "Isolines l after 2, 10 revs over (i, rho0)",
         "faster at high i in the long run"),
    _row("MAG", "2.1.4", "Full vs averaged", "agree to order eps"),
    _row("MAG", "2.2", "Steady offset", "2.3 deg at lambda 0.5, eps 0.1, i 50"),
    _row("MAG", "3.1.1 3.1.2", "Nutation isolines",
         "worst case <= 14 deg at high i after 15 revs, 70 deg"),
    _row("MAG", "3.1.3", "Two coils of three", "damped, slower"),
    _row("MAG", "3.2.1", "Spin-up isolines"),
    _row("MAG", "3.3.1", "rho(u) reorientation", "faster at high i"),
    _row("MAG", "3.3.2 3.3.3 3.3.4 3.3.5 3.3.6 3.3.7", "Three stages at i = 60 and 10",
         "~1500/1000/1000 s; ~5000/1000/very slow"),
    _row("MAG", "3.4.1 3.4.2", "Preliminary 1 maps"),
    _row("MAG", "3.4.3 3.4.4", "Joint with nutation damping", "both succeed"),
    _row("MAG", "3.5.1 3.5.2", "Preliminary 2 maps", "better at low i for theta0 > 45"),
    _row("MAG", "3.5.1t", "Scheme table"),
    _row("MAG", "3.5.3 3.5.4", "UniSat-5 standard vs proposed",
         "106 vs 85 deg before the last stage; few deg at the end"),
    _row("MAG", "4.3.1 4.3.2", "Degree of stability isolines + parabola"),
    _row("MAG", "4.4.1 4.4.2", "Floquet vs averaged; instability region"),
    _row("MAG", "4.4.3", "Nonlinear three-axis run", "settles"),
    _row("MAG", "4.4", "Accuracy under gravity, and remedies (end of 4.4)",
         "a little better than 10 deg"),
    _row("MAG", "5.1.1 5.1.2", "B-dot under 3 models", "~2 revs; steady 2 omega0"),
    _row("MAG", "5.2.1 5.2.2", "Bench", "~700 s from 15 deg/s to ~0.6 deg/s"),
    _row("MAG", "5.3.1 5.3.2 5.3.3", "Magnetometer vs IGRF on the TLE orbit",
         "~1500 nT, mostly < 1000"),
    _row("MAG", "5.3.4 5.3.5", "Flight-like B-dot", "5x in 30 min; ~5 min"),
    _row("MAG", "II.8", "Field of the bench: pairs of square coils (App. II)",
         "practically uniform in a ball of 650 mm"),
    _row("MAG", "coil", "Dipole of a coil by power and mass (introduction)",
         "aluminium takes half the power of copper"),
    _row("SDOT", "3.11 3.12 3.13 3.14 3.15 3.16 3.17", "Simulation ladder"),
    _row("SDOT", "2.1t", "Table of stable equilibria"),
    _row("SDOT", "2.18", "Final momentum vs simulation", "near-exact in 3.11"),
    _row("SDOT", "gravity", "Fig. 3.11's gain with gravity gradient (3.2)", "about 20 deg"),
    _row("SDOT", "relay", "S-dot with relay control (3.2)", "not satisfactory"),
    _row("SDOT", "1.13", "Lyapunov function and damping in the orbital frame, (1.11) to (1.13)",
         "asymptotically stable"),
    _row("SDOT", "3.18 3.19 3.20 3.21", "Logic diagrams, generated from the code"),
    _row("SDOT", "3.22 3.23 3.24 3.25 3.26", "Acquisition; shadow switching"),
    _row("SDOT", "3.27 3.28 3.29 3.30 3.31 3.32 3.33", "S-dot sessions",
         "gamma, theta -> 0 or pi"),
    _row("SDOT", "3.1t 3.2t 3.3t 3.4t 3.5t", "Sensor, threshold, actuator tables"),
    _row("SDOT", "A", "Packets, boot sequence, modules"),
    _row("WHEEL", "2 3 5 6", "Polyhedra P4, P3, P6, P5",
         "vertex/face counts 14/12, 8/6, 32/30, 22/20"),
    _row("WHEEL", "8", "Ellipsoid in polyhedron",
         "0.184 (0.190 out), 0.092, 0.292, 0.184 deg/s"),
    _row("WHEEL", "4.1", "Greatest angular acceleration (WHEEL section 4)"),
    _row("WHEEL", "balanced", "Balanced angles (WHEEL section 3)", "80.5, 45.5; gamma"),
    _row("WHEEL", "9", "Optimal angles vs H3/H2", "70.0, 21.5 at 6.4"),
    _row("WHEEL", "10 11 12 13", "Five-day run", "+-0.005/0.5/0.05 deg; 1.4x; +31 h"),
    _row("WHEEL", "14", "f(alpha, beta)", "f_min 19.4 N m s"),
    _row("MGS", "1", "Stage 1 simulation"),
    _row("MGS", "12", "12th-order model, stability"),
    _row("MGS", "2", "Stage 2 simulation, compensation", "no steady error to a constant dipole"),
    _row("MGS", "15", "15th-order model, parameter choice"),
)  # fmt: skip


@dataclass(frozen=True)
class Omission:
    """A printed result without an entry: where it stands, what it is, why it is left out."""

    source: str
    content: str
    reason: str


#: What the sources print besides, of which no entry is made.
LEFT_OUT: tuple[Omission, ...] = (
    Omission("SDOT", "predictive regulator of its reference 21, with the formula of the prediction",
             "a law of others in a survey: the functional that it minimises is not printed, nor a "
             "result; and the printed right-hand side applies I^-1 to omega x omega_o i_o, which "
             "is an acceleration already"),
    Omission("SDOT", "Table A.1: drivers of I2C, SPI, RS485, CAN and the parallel bus",
             "registers of hardware, which a simulation has none of; what they carry is simulated "
             "(SDOT-A)"),
    Omission("SDOT", "Figs. 3.1 to 3.10", "photographs and a drawing of the satellite"),
    Omission("MAG", "coils of Chibis-M, solenoids with a core of permalloy (App. II)",
             "neither size, turns, current nor the core's permeability are printed, only 3.2 A "
             "m^2; `torquer design coil` has the formulas of a coil with a core"),
    Omission("MAG", "Sun simulator, a lamp of 80 000 lx up to 1.5 m (App. II)",
             "a purchased lamp: no number follows from another"),
    Omission("MAG", "the first of two tables that are both numbered II.1, sensors",
             "the numbers of SDOT Table 3.1, see SDOT-3.1t; those of the second, torques on the "
             "bench, are flown in MAG-5.2.1"),
    Omission("MGS", "relay magnets that work above thresholds, and the choice of TechSat",
             "neither thresholds nor a result is printed; the simulated relay has no dead zone"),
)  # fmt: skip

#: The row of every id.
ROW_OF = {id_: row for row in ROWS for id_ in row.ids}


def known_id(asked: str) -> str:
    """The catalogue's spelling of an id, any case; `ValueError` with near matches if unknown."""
    spelled = {id_.casefold(): id_ for id_ in ROW_OF}
    if asked.casefold() in spelled:
        return spelled[asked.casefold()]
    near = difflib.get_close_matches(asked.casefold(), spelled, n=3, cutoff=0.5)
    hint = f"near it: {', '.join(spelled[n] for n in near)}" if near else "see: gallery list"
    raise ValueError(f"gallery: must be an id of the catalogue; received {asked!r}; {hint}")
