"""FIELD's satellite of section 3 under its four field models.

FIELD's orbital axes are up, along the motion, normal; the body's axes keep FIELD's numbers, so
that its attitude, Euler turns 1-3-2 from the orbital frame, passes through a change of axes.

What the text leaves open and is chosen here: the date, and so the dipole's longitude; the node
(several are run, for the models that turn with the Earth); rates relative to the orbital frame
('the motion takes place in the orbital frame'); coils limited one by one, the vector scaled.
"""

from dataclasses import dataclass

import numpy as np

from gallery.entry import within
from torquer.maths.geometry import euler
from torquer.maths.geometry.quaternion import from_dcm
from torquer.maths.geometry.vec3 import as_matrix
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

MU_E_T_KM3 = 7.812e6
#: FIELD's four models; the tilted dipole at the longitude that IGRF-14 has in 2015.
MODELS = {
    "IGRF-14": {"kind": "igrf14"},
    "tilted dipole": {"kind": "tilted_dipole", "mu_e_t_km3": MU_E_T_KM3, "tilt_deg": 168.3,
                      "longitude_deg": 107.4},
    "direct dipole": {"kind": "direct_dipole", "mu_e_t_km3": MU_E_T_KM3},
    "averaged": {"kind": "averaged", "mu_e_t_km3": MU_E_T_KM3},
}  # fmt: skip
TURNING_WITH_THE_EARTH = ("IGRF-14", "tilted dipole")
NODES_DEG = tuple(range(0, 360, 30))
START = "2015-01-01T00:00:00Z"
#: Components in FIELD's orbital axes (up, motion, normal) to those in X (motion, normal, up).
_FIELD_TO_X = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Case:
    """One of FIELD's simulations: Euler angles 1-3-2, gain of B-dot, pitch wheel, length."""

    euler_132_deg: tuple[float, float, float]
    gain_a_m2_s_per_t: float
    wheel_n_m_s: float
    revolutions: float
    record_s: float = 10.0


def attitude(euler_132_deg) -> list[float]:
    """Quaternion, body to X, of FIELD's Euler angles."""
    dcm = _FIELD_TO_X @ euler.to_dcm("132", np.radians(euler_132_deg))
    return [float(x) for x in from_dcm(as_matrix(dcm))]


def scenario(case: Case, model: str, node_deg: float = 0.0):
    """The case under a model: 1000 km, 82.5 deg, gravity gradient, coils of 250 A m^2."""
    return scenario_from_data({
        "start": START,
        "orbit": {"kind": "circular", "altitude_km": 1000.0, "inclination_deg": 82.5,
                  "raan_deg": node_deg},
        "environment": {"field": MODELS[model], "earth_rotation": "sidereal"},
        "spacecraft": {
            "body": {"inertia_kg_m2": [5750.0, 2450.0, 4000.0],
                     "wheel_momentum_n_m_s": [0.0, 0.0, case.wheel_n_m_s]},
            "coils": {"limit_a_m2": 250.0},
        },
        "initial": {"quaternion": attitude(case.euler_132_deg), "reference": "orbital",
                    "rate_deg_s": [float(x) for x in np.degrees([1e-3, 2e-3, 3e-3])],
                    "rate_relative_to": "orbital"},
        "control": {"law": {"kind": "bdot_derivative",
                            "gain_a_m2_s_per_t": case.gain_a_m2_s_per_t}, "sample_s": 1.0},
        "simulation": {"revolutions": case.revolutions, "record_s": case.record_s},
    })  # fmt: skip


@dataclass(frozen=True)
class Course:
    """Time histories of a run."""

    revolutions: np.ndarray
    rate_per_s: np.ndarray
    wheel_axis_deg: np.ndarray

    def first_below(self, values: np.ndarray, limit: float) -> float:
        """Revolutions until values are below a limit for the first time; inf if never."""
        below = values < limit
        return float(self.revolutions[np.argmax(below)]) if below.any() else float("inf")


def course(case: Case, model: str, node_deg: float = 0.0) -> Course:
    """Simulate; rate relative to the orbital frame, angle of body axis 3 to the orbit normal."""
    from scipy.spatial.transform import Rotation

    run = scenario(case, model, node_deg)
    result = simulate(run)
    normal = np.cross(result["position_inertial"].values, result["velocity_inertial"].values)
    axis = Rotation.from_quat(result["q_body_to_inertial"].values).apply([0.0, 0.0, 1.0])
    across = np.linalg.norm(np.cross(axis, normal), axis=1)
    return Course(
        result["time"].values / run.orbit.period_s,
        np.linalg.norm(result["omega_orbital"].values, axis=1),
        np.degrees(np.arctan2(across, np.sum(axis * normal, axis=1))),
    )


def courses(case: Case) -> dict[str, list[Course]]:
    """By model: one run at each node, or one where the node has no effect."""
    return {
        model: [
            course(case, model, node)
            for node in (NODES_DEG if model in TURNING_WITH_THE_EARTH else (0,))
        ]
        for model in MODELS
    }


def by_node(runs: dict[str, list[Course]], measure) -> np.ndarray:
    """A number of every run `[model, node]`; a run without a node counts at all of them."""
    return np.array(
        [
            np.broadcast_to([measure(run) for run in found], len(NODES_DEG))
            for found in runs.values()
        ]
    )


def spread_at_a_node(values: np.ndarray) -> float:
    """Spread of the models at one node (median of the nodes) over IGRF's spread between nodes.

    Below one, the choice of the model matters less than the node, which the text leaves open.
    """
    return float(np.median(np.ptp(values, axis=0)) / np.ptp(values[0]))


IGRF, TILTED, DIRECT, AVERAGED = range(4)
PAIRS = [(a, b) for a in range(4) for b in range(a)]
_CLOSE, _WORSE = "the two dipole models are especially close", "IGRF slightly worse"


def distances(runs: dict[str, list[Course]], values_of) -> dict[tuple[int, int], np.ndarray]:
    """Root mean square distance of the courses of two models, node by node."""
    values = np.array([
        [values_of(found[node % len(found)]) for node in range(len(NODES_DEG))]
        for found in runs.values()
    ])  # fmt: skip
    return {(a, b): np.sqrt(np.mean((values[a] - values[b]) ** 2, axis=-1)) for a, b in PAIRS}


def closest(apart: dict[tuple[int, int], np.ndarray]) -> int:
    """Number of nodes where no pair of models is closer than the two dipoles."""
    least = np.min(list(apart.values()), axis=0)
    return int(np.sum(apart[DIRECT, TILTED] <= least))


def comparison(runs: dict[str, list[Course]], values_of, times, left, what: str) -> tuple:
    """Checks of what FIELD says of Fig. 8, and of Fig. 9 as analogous.

    `values_of(run)`: the course; `times` and `left` `[model, node]`: when it is below a limit, what
    remains of it in the end; `what`: its name.
    """
    apart = distances(runs, values_of)
    in_time = {(a, b): np.abs(times[a] - times[b]) for a, b in PAIRS}
    stands_off = np.median(apart[AVERAGED, DIRECT] / apart[DIRECT, TILTED])
    nodes = len(NODES_DEG)
    return (
        within("spread of the times at a node, over IGRF's between nodes",
               "times differ insignificantly", spread_at_a_node(times), high=1.0),
        within(f"nodes, of {nodes}, where the dipoles' transients are the closest pair", _CLOSE,
               closest(apart), low=0.5 * nodes),
        within(f"nodes, of {nodes}, where the dipoles' times are the closest pair", _CLOSE,
               closest(in_time), low=0.5 * nodes),
        within("averaged to direct dipole, over tilted to direct (transients)",
               "averaged differs from the dipoles", stands_off, low=1.0),
        within(f"nodes, of {nodes}, where IGRF takes longer than the direct dipole", _WORSE,
               np.sum(times[IGRF] > times[DIRECT]), low=0.5 * nodes),
        within(f"{what} left over with IGRF, over that with the direct dipole", _WORSE,
               left[IGRF].mean() / left[DIRECT].mean(), low=1.0, high=1.25),
    )  # fmt: skip


def draw(axes, runs: dict[str, list[Course]], values_of) -> None:
    """Every model's course at the first node."""
    from gallery.drawing import MODEL_COLOURS

    for model, found in runs.items():
        first = found[0]
        axes.plot(
            first.revolutions, values_of(first), color=MODEL_COLOURS[model], lw=1.2, label=model
        )
    axes.set_xlim(0.0, runs["averaged"][0].revolutions[-1])
