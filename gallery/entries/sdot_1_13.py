"""SDOT (1.11) to (1.13): a Lyapunov function by the Jacobi integral, and the damping that it gives.

With the integral as corrected, (T + G - 2K)/2, the function V = J - omega0^2 (3 C - B)/2 has the
derivative m.(B x Omega), and m = k Omega x B makes it fall: the law in the package is the
three-axis one without its position part. Flown from attitudes and rates drawn at random, with IGRF;
the moments are those of Chibis-M with the least one about the vertical and the greatest about the
normal.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from gallery.drawing import BLUE, GREY, label, new_figure
from gallery.entry import Answer, Entry, consistent, share, within
from torquer.analysis.attitude import orbital_axes
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

STARTS, HOURS = 48, 24.0
#: About the motion, the normal and the vertical [kg m^2]: gravity holds this order.
MOMENTS = np.array([1.5393, 1.8172, 1.0255])
#: k [N m s/T^2].
GAIN = 1e6
STILL_DEG = 20.0


def flown(number: int):
    """(Time [h], V as printed and corrected, over 1.5 omega0^2 (C - A); angle [deg] of the nearest
    of the four stable attitudes) of a start."""
    rng = np.random.default_rng(number)
    rate = rng.normal(size=3)
    rate *= rng.uniform(0.02, 0.3) / np.linalg.norm(rate)
    result = simulate(scenario_from_data({
        "start": "2012-03-20T12:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 350.0, "inclination_deg": 51.7,
                  "raan_deg": rng.uniform(0.0, 360.0)},
        "environment": {"field": {"kind": "igrf14", "degree": 10}, "gravity_gradient": True},
        "spacecraft": {"body": {"inertia_kg_m2": MOMENTS.tolist()}, "coils": {"limit_a_m2": 1e6}},
        "initial": {"quaternion": Rotation.random(random_state=rng).as_quat().tolist(),
                    "rate_deg_s": rate.tolist()},
        "control": {"law": {"kind": "three_axis", "rate_gain_n_m_s_per_t2": GAIN,
                            "angle_gain_n_m_per_t2": 0.0}, "sample_s": 1.0},
        "simulation": {"duration_s": 3600.0 * HOURS, "record_s": 60.0},
    }))  # fmt: skip
    r, v = result["position_inertial"].values, result["velocity_inertial"].values
    frame = orbital_axes(r, v)
    turn = frame.inv() * Rotation.from_quat(result["q_body_to_inertial"].values)
    omega0 = float(np.linalg.norm(np.cross(r[0], v[0])) / (r[0] @ r[0]))
    return (result["time"].values / 3600.0, *_energies(result, turn, frame, r, v, omega0),
            nearest_deg(turn))  # fmt: skip


def _energies(result, turn, frame, r, v, omega0: float):
    """V by the printed and by the corrected integral, over 1.5 omega0^2 (C - A)."""
    body = Rotation.from_quat(result["q_body_to_inertial"].values).inv()
    up, normal = (x / np.linalg.norm(x, axis=1)[:, None] for x in (r, np.cross(r, v)))
    up, normal = body.apply(up), body.apply(normal)
    momentum = result["omega_body"].values * MOMENTS
    kinetic = np.sum(result["omega_body"].values * momentum, axis=1)
    gravity = 3.0 * omega0**2 * np.sum(up * up * MOMENTS, axis=1)
    coupled = omega0 * np.sum(normal * momentum, axis=1)
    unit = 1.5 * omega0**2 * (MOMENTS.max() - MOMENTS.min())
    least = omega0**2 * (3.0 * MOMENTS.min() - MOMENTS.max()) / 2.0
    return [(0.5 * (kinetic + gravity - n * coupled) - least) / unit for n in (1.0, 2.0)]


def nearest_deg(turn: Rotation) -> np.ndarray:
    """Angle of the turn from the nearest attitude with both axes along theirs, either way [deg]."""
    ends = [Rotation.identity(), *(Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3))]
    return np.degrees(np.min([(turn * end).magnitude() for end in ends], axis=0))


def compute() -> Answer:
    """How V falls, and where the satellite ends."""
    runs = [flown(number) for number in range(STARTS)]
    rises = [np.diff(right).max() for _, _, right, _ in runs]
    printed = [np.diff(wrong).max() for _, wrong, _, _ in runs]
    held = np.array([angle[-1] < STILL_DEG for *_, angle in runs])
    fallen = np.array([right[-1] / right[0] for _, _, right, _ in runs])
    checks = (
        within("corrected V: greatest rise in a minute, over 1.5 omega0^2 (C - A)",
               "negative derivative", max(rises), high=1e-9),
        consistent(within("printed V: the same, least of the starts", "it does rise (errata)",
                          min(printed), low=1e-3)),
        share(f"part of {STARTS} starts within {STILL_DEG:g} deg of an orbital attitude after "
              f"{HOURS:.0f} h", "asymptotically stable orbital attitude", held, low=0.95),
        within("V at the end over that at the start, greatest", "negative derivative",
               fallen.max(), high=0.1),
    )  # fmt: skip
    note = (
        f"{STARTS} starts of {HOURS:.0f} h, attitude, node and rates of 0.02 to 0.3 deg/s drawn, "
        f"k = {GAIN:g} N m s/T^2 chosen; least moment up, greatest along the normal. Angles at the "
        f"end: {np.min([a[-1] for *_, a in runs]):.1f} to "
        f"{np.max([a[-1] for *_, a in runs]):.1f} deg."
    )
    return Answer(checks, {"": picture(runs)}, note)


def picture(runs):
    """V over time, of all starts, as corrected; and of the first as printed."""
    figure, panels = new_figure("Lyapunov function of (1.11) to (1.13)", 2, 5.0, sharex=True)
    for t_h, _, right, angle in runs:
        panels[0].plot(t_h, np.maximum(right, 1e-6), color=BLUE, lw=0.5, alpha=0.5)
        panels[1].plot(t_h, angle, color=BLUE, lw=0.5, alpha=0.5)
    panels[0].plot(runs[0][0], np.maximum(runs[0][1], 1e-6), color=GREY, lw=1.0,
                   label="with the printed integral, one start")  # fmt: skip
    panels[0].set(yscale="log", ylim=(1e-4, None), xlim=(0.0, HOURS))
    label(panels[0], "", "V / (3/2 ω₀² (C - A))")
    panels[1].set(ylim=(0.0, 130.0))
    label(panels[1], "time [h]", "to the nearest orbital\nattitude [deg]", legend=False)
    return figure


ENTRY = Entry(ids=("SDOT-1.13",), compute=compute, slow=True)
