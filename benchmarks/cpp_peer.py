"""The C++ rival inside this process, through ctypes, so that timings can interleave."""

import ctypes

import numpy as np
from build import build_cpp
from detumble_task import DEGREE, Task

_NUMBER, _COUNT = ctypes.c_double, ctypes.c_long
_ARRAY = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
_TASK = [_ARRAY, *5 * [_NUMBER], _ARRAY, _COUNT]
_SIGNATURES = {
    "set_coefficients": [_ARRAY, _ARRAY],
    "field_many": [_ARRAY, _COUNT, _ARRAY],
    "detumble": [*_TASK, ctypes.c_int, _ARRAY],
    "detumble_shared": [*_TASK, _ARRAY],
}


class CppPeer:
    """detumble.cpp with the given Gauss coefficients g[n, m], h[n, m] [nT].

    `wide` takes the hand-vectorised field. One set of coefficients per library: the
    last-made object of a kind decides.
    """

    def __init__(self, g, h, wide: bool = False):
        self._library = ctypes.CDLL(str(build_cpp(wide)))
        for name, arguments in _SIGNATURES.items():
            function = getattr(self._library, name)
            function.argtypes, function.restype = arguments, None
        g, h = (np.ascontiguousarray(table, dtype=np.float64) for table in (g, h))
        if g.shape != (DEGREE + 1, DEGREE + 1) or h.shape != g.shape:
            raise ValueError(f"g, h: must have shape (14, 14); received {g.shape}, {h.shape}")
        self._library.set_coefficients(g, h)

    def field(self, points_m) -> np.ndarray:
        """Field [T] at Earth-fixed points [m], rows of three."""
        points = np.ascontiguousarray(points_m, dtype=np.float64).reshape(-1, 3)
        out = np.empty_like(points)
        self._library.field_many(points, len(points), out)
        return out

    def run(self, task: Task, n_steps: int | None = None, substeps: int = 1) -> np.ndarray:
        """Final state; the field in every RK4 stage and once for the law (5 a step)."""
        out = np.empty(7)
        self._library.detumble(*_arguments(task, n_steps), substeps, out)
        return out

    def run_shared(self, task: Task, n_steps: int | None = None) -> np.ndarray:
        """Final state; the environment once per distinct time (2 fields a step)."""
        out = np.empty(7)
        self._library.detumble_shared(*_arguments(task, n_steps), out)
        return out


def _arguments(task: Task, n_steps):
    steps = task.n_steps if n_steps is None else n_steps
    orbit = (task.radius_m, task.inclination_rad, task.theta0_rad)
    coils = (task.gain, task.dipole_max)
    return np.array(task.moments), *orbit, *coils, task.initial_state, steps
