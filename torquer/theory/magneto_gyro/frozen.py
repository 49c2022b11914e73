"""The text's linear models with constant coefficients, in axes that turn with the 'computed field'.

That field has a constant strength A and turns with nu0: (cos, b, -sin) in t, w, s. Axes t', w, s':
t' along the field's part in the orbit's plane; phi and chi are the turns of the pitch axis about t'
and s'. The satellite is axisymmetric, without gravity gradient. Units as in the package; h is the
stiffness, lambda the moment of inertia about the pitch axis. Inputs of both: torque about t', w,
s', error of the magnetometer along them.

These models choose gains; whether a loop is stable only the periodic model tells.
"""

from collections.abc import Sequence

import numpy as np

STATES_1 = ("phi", "phi'", "chi", "chi'", "theta", "theta'", "Y", "Y1", "X", "X1", "Z", "Z1")
STATES_2 = (
    "phi", "phi'", "chi", "chi'", "theta", "theta'", "X1", "X2", "Z1", "Z2", "Y1", "Y2", "Y3",
    "Y4", "Z3",
)  # fmt: skip
#: States of the compensator.
COMPENSATOR = ("Y3", "Y4", "Z3")


def _fill(rows: dict, states: Sequence[str]) -> np.ndarray:
    """A matrix from rows of entries by the names of columns."""
    matrix = np.zeros((len(states), len(states)))
    for row, entries in rows.items():
        for column, value in entries.items():
            matrix[states.index(row), states.index(column)] = value
    return matrix


def frozen_1(k, n, damping, frequency, *, stiffness, pitch_inertia, b=0.0) -> np.ndarray:
    """Matrix of stage 1 `[12, 12]`; states `STATES_1`.

    k = K/[(1 + b^2) J nu0^2] and n = N/[(1 + b^2) J nu0]; the text leaves out 1 + b^2, without
    which its rows do not follow from its law. X, Y, Z: how the filters' outputs along s', w, t'
    differ from those of the calculated field, over A; X1, Y1, Z1 their second states.
    """
    h, w2 = stiffness, frequency**2
    w3 = 2.0 * damping * frequency**3
    w1 = -2.0 * damping * frequency
    rows = {
        "phi": {"phi'": 1}, "chi": {"chi'": 1}, "theta": {"theta'": 1},
        "phi'": {"phi": -(2 * h + k * b * b), "chi'": h - 2, "theta": k * b, "X": n * b},
        "chi'": {"phi'": -(h - 2), "chi": -(2 * h + k * (1 + b * b)), "Y": n, "Z": -n * b},
        "theta'": {"theta": -k, "X": -n, "phi": k * b},
        "Y": {"chi": -w2, "Y1": 1}, "Y1": {"chi": w3, "Y": -w2, "Y1": w1},
        "X": {"theta": w2, "X1": 1, "Z": 1, "phi": -w2 * b},
        "X1": {"theta": -w3, "X": -w2, "X1": w1, "Z1": 1, "phi": w3 * b},
        "Z": {"X": -1, "Z1": 1, "chi": w2 * b},
        "Z1": {"X1": -1, "Z": -w2, "Z1": w1, "chi": -w3 * b},
    }  # fmt: skip
    rows["theta'"] = {name: x / pitch_inertia for name, x in rows["theta'"].items()}
    return _fill(rows, STATES_1)


def frozen_1_inputs(k, n, damping, frequency, *, pitch_inertia, b=0.0) -> np.ndarray:
    """R1 to R9 of stage 1 as a matrix `[12, 6]`; k and n as in `frozen_1`."""
    rest = n / (1 + b * b)
    at = STATES_1.index
    g = np.zeros((12, 6))
    g[at("phi'")] = [1, 0, 0, -rest * b, -rest * b * b, k * b]
    g[at("theta'")] = np.array([0, 1, 0, rest, rest * b, -k]) / pitch_inertia
    g[at("chi'")] = [0, 0, 1, -k * b, k, 0]
    for name, column in (("Z", 3), ("Y", 4), ("X", 5)):
        g[at(name), column] = frequency**2
        g[at(name + "1"), column] = -2.0 * damping * frequency**3
    return g


def frozen_2(gains, *, stiffness, pitch_inertia, b=0.0) -> np.ndarray:
    """Matrix of stage 2 `[15, 15]`; states `STATES_2`, `gains` as `Stage2Gains`.

    X1 to Y2: errors of the estimator; Y3, Y4, Z3: the compensator. The text has plus in Y1 = Y1 -
    theta, against its own equations.
    """
    h, s = stiffness, gains
    pitch = {"theta'": -s.n2, "theta": -s.d2, "Y1": -s.d2, "Y2": -s.n2, "Y4": 1}
    rows = {
        "phi": {"phi'": 1}, "chi": {"chi'": 1}, "theta": {"theta'": 1},
        "phi'": {"phi": -2 * h, "chi'": h - 2, "theta": b * s.d2, "theta'": b * s.n2,
                 "Y1": b * s.d2, "Y2": b * s.n2, "Y4": -b},
        "chi'": {"phi'": -(h - 2 + s.n1), "phi": -s.d1, "chi'": -s.n3, "chi": -(2 * h + s.d3),
                 "X1": -s.d1, "X2": -s.n1, "Z1": -s.d3, "Z2": -s.n3, "Z3": 1, "Y3": b},
        "theta'": {name: x / pitch_inertia for name, x in pitch.items()},
        "X1": {"X2": 1, "Z1": -s.k5},
        "X2": {"X1": -2 * h, "Z2": h - 2, "Z1": -s.k6, "Y4": b},
        "Z1": {"Z2": 1, "Z1": -s.k3},
        "Z2": {"X2": -(h - 2), "Z1": -(2 * h + s.k4), "Z3": -1, "Y3": -b},
        "Y1": {"Y2": 1, "Y1": -s.k1, "phi": -b * s.k1},
        "Y2": {name: x / pitch_inertia for name, x in
               {"Y1": -s.k2, "Y4": -1, "phi": -b * s.k2}.items()},
        "Y3": {"Y1": s.e1, "Y4": -1, "phi": b * s.e1},
        "Y4": {"Y1": s.e2, "Y3": 1, "phi": b * s.e2},
        "Z3": {"Z1": s.e3},
    }  # fmt: skip
    return _fill(rows, STATES_2)


def frozen_2_inputs(gains, *, pitch_inertia) -> np.ndarray:
    """Torque and error of the magnetometer in the rows of stage 2, `[15, 6]`."""
    s, at = gains, STATES_2.index
    g = np.zeros((15, 6))
    g[at("phi'"), 0] = g[at("chi'"), 2] = 1
    g[at("X2"), 0] = g[at("Z2"), 2] = -1
    g[at("theta'"), 1], g[at("Y2"), 1] = 1 / pitch_inertia, -1 / pitch_inertia
    for name, value in (("X1", -s.k5), ("X2", -s.k6), ("Z1", -s.k3), ("Z2", -s.k4), ("Z3", s.e3)):
        g[at(name), 4] = value
    of_pitch = (("Y1", s.k1), ("Y2", s.k2 / pitch_inertia), ("Y3", -s.e1), ("Y4", -s.e2))
    for name, value in of_pitch:
        g[at(name), 5] = value
    return g
