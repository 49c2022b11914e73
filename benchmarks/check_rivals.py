"""Do the rivals solve the same task? `python check_rivals.py [IGRF14.shc]`; raises if not."""

import math
import subprocess
import sys
import tempfile
from datetime import datetime
from pathlib import Path

import numpy as np
import scipy_loop
from build import build_program
from cpp_peer import CppPeer
from detumble_task import COEFFICIENTS, Task, read_coefficients, write_coefficients

#: Not zero, so that the sign and the zero of the Earth's turn are tested too.
TURNED = Task(theta0_rad=1.0)


def _require(name: str, value: float, limit: float) -> None:
    if not value <= limit:
        raise AssertionError(f"{name}: must be at most {limit:g}; received {value:g}")
    print(f"{name}: {value:.2g} (at most {limit:g})")


def _points(count: int) -> np.ndarray:
    """Points in all directions, 6600 to 8000 km from the centre [m]."""
    random = np.random.default_rng(1)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return directions * random.uniform(6.6e6, 8.0e6, size=(count, 1))


def check_field(path) -> None:
    """C++ (both forms) and NumPy against ppigrf [nT], component by component.

    At 1 January 2010, an epoch of the model, because ppigrf interpolates in days and not in
    years. Limit: rounding of a sum of 195 terms of up to 3e4 nT (1e-16 * 3e4 * 195 = 6e-10).
    """
    import ppigrf

    g, h = read_coefficients(path, 2010.0)
    points = _points(50)
    x, y, z = points.T
    r = np.linalg.norm(points, axis=1)
    theta, phi = np.arccos(z / r), np.arctan2(y, x)
    angles = np.degrees(theta), np.degrees(phi)
    parts = ppigrf.igrf_gc(r / 1e3, *angles, datetime(2010, 1, 1))
    b_r, b_theta, b_phi = (np.ravel(part) for part in parts)
    radial_xy = b_r * np.sin(theta) + b_theta * np.cos(theta)
    b_x = radial_xy * np.cos(phi) - b_phi * np.sin(phi)
    b_y = radial_xy * np.sin(phi) + b_phi * np.cos(phi)
    expected = np.stack([b_x, b_y, b_r * np.cos(theta) - b_theta * np.sin(theta)], axis=1)
    field = scipy_loop.Field(g, h)
    for name, found in (
        ("C++", CppPeer(g, h).field(points)),
        ("C++ wide", CppPeer(g, h, wide=True).field(points)),
        ("NumPy", np.array([field(point) for point in points])),
    ):
        _require(f"field {name} - ppigrf [nT]", np.abs(1e9 * found - expected).max(), 1e-9)


def check_scipy(path, seconds: int = 200) -> None:
    """C++ against SciPy after `seconds`: RK4 converges to it, with order 4.

    With the task's step of 1 s, RK4 turns a body at 0.3 rad/s with a local error of about
    (0.15)^5 / 120 = 6e-7 in the quaternion, hence some 1e-4 after 200 steps: the truncation
    error of the method, which all rivals with RK4 share. So the comparison halves the step:
    the difference must fall 16-fold each time (order within 0.2 of 4) and, at 1/32 s, by
    32^4 = 1e6, to below 1e-9.
    """
    g, h = read_coefficients(path)
    reference, _ = scipy_loop.run(TURNED, g, h, seconds)
    cpp = CppPeer(g, h)
    errors = {
        k: np.abs(cpp.run(TURNED, seconds, substeps=k) - reference).max() for k in (1, 2, 4, 32)
    }
    _require(f"C++ - SciPy after {seconds} s, step 1 s", errors[1], 5e-4)
    for k in (1, 2):
        order = math.log2(errors[k] / errors[2 * k])
        _require(f"|order of RK4 - 4| from step 1/{k} s", abs(order - 4.0), 0.2)
    _require(f"C++ - SciPy after {seconds} s, step 1/32 s", errors[32], 1e-9)


def check_forms(path) -> None:
    """Shared environment, wide field and the program against plain C++ after 1000 s.

    The same arithmetic but for rounding, which the finite differences of the law amplify
    (1e-16 * 5e-5 T times the gain of 1e6 is 5e-15 A m^2 a step).
    """
    g, h = read_coefficients(path)
    cpp, wide = CppPeer(g, h), CppPeer(g, h, wide=True)
    expected = cpp.run(TURNED, 1000)
    found = {
        "shared": cpp.run_shared(TURNED, 1000),
        "wide": wide.run(TURNED, 1000),
        "wide, shared": wide.run_shared(TURNED, 1000),
        "program": _program(g, h, 1000),
    }
    for name, state in found.items():
        _require(f"C++ {name} - C++ plain", np.abs(state - expected).max(), 1e-10)


def _program(g, h, seconds: int) -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coefficients.txt"
        write_coefficients(path, g, h)
        degrees = math.degrees(TURNED.theta0_rad)
        arguments = [str(path), f"steps={seconds}", f"theta0_deg={degrees!r}"]
        done = subprocess.run(
            [str(build_program()), *arguments], capture_output=True, text=True, check=True
        )
    return np.array([float(word) for word in done.stdout.split()])


def check_all(path=COEFFICIENTS) -> None:
    """Every check; an AssertionError names the first that fails."""
    check_field(path)
    check_scipy(path)
    check_forms(path)


if __name__ == "__main__":
    check_all(*sys.argv[1:2])
