"""Parts of the user's own, as files, for tests of all that takes a part of its kind."""

from pathlib import Path

from torquer.base.user_code import admit
from torquer.environment.earth.atmosphere import ATMOSPHERES
from torquer.environment.field import FIELDS

TEXT = '''
import numpy as np


def ring(t_s, start, radius_km=6928.137, tilt_deg=97.6):
    """A circular orbit."""
    a = 1e3 * radius_km
    n = np.sqrt(3.986004418e14 / a**3)
    u, i = n * t_s, np.radians(tilt_deg)
    across = np.array([0.0, np.cos(i), np.sin(i)])
    node = np.array([1.0, 0.0, 0.0])
    r = np.cos(u)[:, None] * node + np.sin(u)[:, None] * across
    v = np.cos(u)[:, None] * across - np.sin(u)[:, None] * node
    return a * r, a * n * v


def dipole(r_ecef_m, years, scale=1.0):
    """A dipole along the Earth's axis."""
    distance = np.linalg.norm(r_ecef_m, axis=1)[:, None]
    up = r_ecef_m / distance
    moment = np.array([0.0, 0.0, -7.8e15]) * scale
    return (3.0 * up * (up @ moment)[:, None] - moment) / distance**3


def air(r_ecef_m, years, density=5e-13):
    """The same density everywhere."""
    return np.full(len(r_ecef_m), density)


def leak(here, size=1e-6, damping=0.0, growth=0.0):
    """A jet along x, a torque against the rate, and one that grows about z."""
    x, y, z = here.omega_body_rad_s
    return (size - damping * x, -damping * y, growth * here.t_s - damping * z)


def crosswise(here, gain=2.0):
    """The field in microtesla in other axes, and the light."""
    b, noise = here.b_body_t, here.noise
    return (gain * 1e6 * b[1] + noise[0], 1e6 * b[0], here.sunlit_fraction)


def all_of_it(here, share=1e-9):
    """What depends on all that there is."""
    b, up, light, flow = here.b_body_t, here.up_body, here.light_body_pa, here.flow_body
    return (
        share * (up[0] + 1e5 * light[1]),
        share * (flow[1] + 1e4 * b[0]),
        share * here.argument_of_latitude_rad,
    )
'''


def write(folder: Path, text: str = TEXT) -> Path:
    """A file of parts in a folder."""
    file = folder / "own.py"
    file.write_text(text)
    return file


def field_of(kind: str, folder: Path):
    """A field model of a kind, with its defaults; the user's own is a dipole."""
    if kind != "user":
        return FIELDS[kind]()
    made = FIELDS[kind](kind="user", file=write(folder), function="dipole")
    admit(made)
    return made


def atmosphere_of(folder: Path, **keys):
    """An atmosphere of the user's own."""
    made = ATMOSPHERES["user"](kind="user", file=write(folder), function="air", **keys)
    admit(made)
    return made
