"""SDOT Tables 3.1 to 3.5: sensors, thresholds of the state vector, actuators.

Noise and ranges are measured on simulated readings of the shipped sensors; thresholds are found
by halving on the logic that flies (`gallery.logic`), and the classes of Table 3.2 on the flight
software's function. The actuators of Table 3.5 are those that each state of the table lets work.
"""

import math

import numpy as np

from gallery.drawing import BLUE, GREEN, GREY, ORANGE, label, new_figure
from gallery.entries.sdot_3_18 import ESTIMATORS, automatic, flight
from gallery.entry import Answer, Entry, Grade, Verdict, near, uncertain, within
from gallery.logic import Logic, turning_point
from torquer.flight.software.modules.svr import (
    MAX,
    MIN,
    NONE,
    NORM,
    SvrSettings,
    classify_value,
)
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

HOURS = 9.0
#: Which actuators work in each configuration of Table 3.5: coils, wheels.
CONFIGURATIONS = {"stb_00": (False, False), "stb_0t": (True, False), "stb_0w": (False, True),
                  "stb_tw": (True, True)}  # fmt: skip


def flown(hours: float, rate_deg_s, **sensors):
    """Readings of the shipped sensors with other values, once a second, of a body that turns."""
    presets = {"magnetometer": "hmr2300r", "gyro": "adis16130", "sun_sensors": "dss3"}
    return simulate(scenario_from_data({
        "start": "2012-03-20T12:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 500, "inclination_deg": 51.7},
        "environment": {"field": {"kind": "igrf14", "degree": 10}, "eclipse": "none",
                        "gravity_gradient": False},
        "spacecraft": {"body": {"inertia_kg_m2": [1.0, 1.0, 1.0]},
                       **{name: {"preset": preset} | sensors.get(name, {})
                          for name, preset in presets.items()}},
        "initial": {"euler_deg": [0.0, 0.0, 0.0], "rate_deg_s": rate_deg_s},
        "control": {"law": {"kind": "off"}, "sample_s": 1.0},
        "simulation": {"duration_s": 3600.0 * hours, "record_s": 1.0},
    }))  # fmt: skip


def of_sensors() -> tuple:
    """Table 3.1: noise and range of the three kinds of sensors."""
    at_rest = flown(HOURS, [0.0, 0.0, 0.0])
    noise_nt = 1e9 * (at_rest["b_measured"] - at_rest["b_body"]).values.std()
    noise_deg_s = np.degrees((at_rest["omega_measured"] - at_rest["omega_body"]).values.std())
    off_zero = flown(0.1, [0.0, 0.0, 0.0], magnetometer={"bias_nt": [-3e5, 3e5, 3e5]})
    fast = flown(0.1, [0.0, 0.0, 300.0])
    angle, seen = sun_angles()
    return (
        uncertain(near("Table 3.1: magnetometer, noise", "50", noise_nt, "nT"), 0.1),
        near("Table 3.1: magnetometer, range", "200000",
             1e9 * np.abs(off_zero["b_measured"].values).max(), "nT", 1.0, "200 000 nT"),
        uncertain(near("Table 3.1: gyro, noise", "0.01", noise_deg_s, "deg/s", 5e-4), 1e-5),
        near("Table 3.1: gyro, range", "250",
             np.degrees(np.abs(fast["omega_measured"].values).max()), "deg/s"),
        near("Table 3.1: Sun sensor, greatest angle at which it sees the Sun", "45",
             angle[seen].max(), "deg"),
        uncertain(near("Table 3.1: Sun sensor, noise", "0.1", sun_noise_deg(at_rest), "deg", 5e-3),
                  1e-3),
    )  # fmt: skip


def sun_body(result) -> np.ndarray:
    """Unit vectors to the Sun in body axes."""
    return to_body(result["q_body_to_inertial"].values, result["sun_inertial"].values)


def sun_angles() -> tuple[np.ndarray, np.ndarray]:
    """Angle of the Sun from one sensor's axis [deg], and whether it is seen, over a slow turn."""
    turning = flown(1.0, [0.0, 0.05, 0.0], sun_sensors={"axes": [[0, 0, 1]], "noise_deg": 0.0})
    sun = sun_body(turning)
    angle = np.degrees(np.arctan2(np.hypot(sun[:, 0], sun[:, 1]), sun[:, 2]))
    return angle, np.linalg.norm(turning["sun_measured"].values, axis=1) > 0.5


def sun_noise_deg(result) -> float:
    """Standard deviation across the Sun's direction, of either component, where it is seen."""
    sun, measured = sun_body(result), result["sun_measured"].values
    seen = np.linalg.norm(measured, axis=1) > 0.5
    off = np.cross(sun[seen], measured[seen])
    return float(np.degrees(math.sqrt(np.mean(np.sum(off * off, axis=1)) / 2.0)))


def of_classes() -> tuple:
    """Table 3.2: the classes of an element, of settings of the supervisor as delivered."""
    settings = SvrSettings()
    low, high = settings.rate_min_deg_s, settings.rate_max_deg_s
    found = [classify_value(a, low, high) for a in (math.nan, 2.0 * high, high, low, 0.5 * low)]
    right = np.equal(found, [NONE, MAX, NORM, NORM, MIN])
    return (
        within("Table 3.2: elements in the right class, of 5: unknown, above, at MAX, at MIN, "
               "below", "Anone, Amax, Anorm, Anorm, Amin", right.sum(), low=5.0),
        near("Table 3.3: MAX of the supervisor", "0.4", class_edge(MAX, low, high), "deg/s"),
        near("Table 3.3: MIN of the supervisor", "0.08", class_edge(MIN, low, high), "deg/s"),
        near("Table 3.4: MAX of the supervisor", "0.15",
             class_edge(MAX, settings.q_min, settings.q_max)),
        near("Table 3.4: MIN of the supervisor", "0.02",
             class_edge(MIN, settings.q_min, settings.q_max)),
    )  # fmt: skip


def class_edge(kind: int, low: float, high: float) -> float:
    """The value at which a class begins."""
    far = 0.0 if kind == MIN else 10.0 * high
    return turning_point(lambda a: classify_value(a, low, high) == NORM, math.sqrt(low * high), far)


def science(**known) -> str:
    """State of stabilisation a second after fine pointing, with other knowledge."""
    made = Logic(automatic(), ("damping", "hold", "unload"), ESTIMATORS)
    made(330, sun_deg=30.0, rate_deg_s=0.2, error_deg=40.0)(80, sun_deg=30.0)
    if made.now("stabilisation") != "science":
        raise RuntimeError(f"logic: must be in science; received {made.now('stabilisation')}")
    return made(1, sun_deg=30.0, **known).now("stabilisation")


def acquired(**known) -> str:
    """State of stabilisation after a minute and more of acquisition."""
    made = Logic(automatic(), ("damping", "hold", "unload"), ESTIMATORS)
    made(330, sun_deg=30.0, rate_deg_s=0.2, error_deg=40.0)
    return made(80, sun_deg=30.0, **known).now("stabilisation")


def of_logic() -> tuple:
    """Tables 3.3, 3.4: where fine pointing is left and entered, and what turns these are."""
    leaves_deg = turning_point(lambda a: science(error_deg=a) == "science", 1.0, 40.0)
    enters_deg = turning_point(lambda a: acquired(error_deg=a) == "acquisition", 10.0, 0.5)
    return (
        near("Table 3.3: fine pointing is left above", "0.4",
             turning_point(lambda rate: science(rate_deg_s=rate) == "science", 0.0, 0.55), "deg/s"),
        near("Table 3.3: fine pointing is entered below", "0.08",
             turning_point(lambda rate: acquired(rate_deg_s=rate) == "acquisition", 0.3, 0.0),
             "deg/s"),
        near("Table 3.4: |q| at which fine pointing is left", "0.15",
             math.sin(math.radians(0.5 * leaves_deg))),
        near("Table 3.4: |q| at which fine pointing is entered", "0.02",
             math.sin(math.radians(0.5 * enters_deg))),
        near("Table 3.4: turn with |q| = 0.15", "10", 2.0 * math.degrees(math.asin(0.15)), "deg",
             printed="about 10 deg"),
        near("Table 3.4: turn with |q| = 0.02", "2", 2.0 * math.degrees(math.asin(0.02)), "deg",
             printed="about 2 deg"),
    )  # fmt: skip


def of_actuators() -> tuple:
    """Table 3.5: the configurations, and what works in each."""
    states = flight().regions["actuators"].states
    right = [
        (states[name].coils != "off", states[name].wheels != "off") == works
        for name, works in CONFIGURATIONS.items()
    ]
    return (
        near("Table 3.5: configurations", "4", len(states), printed="4"),
        within("Table 3.5: configurations whose coils and wheels work as printed, of 4",
               "none, coils, wheels, both", sum(right), low=4.0),
    )  # fmt: skip


def compute() -> Answer:
    """Sensors by their readings, thresholds by the logic."""
    checks = (*of_sensors(), *of_classes(), *of_logic(), *of_actuators())
    note = (
        f"Noise over {HOURS:.0f} h of readings, one a second. Sensors, thresholds and "
        "configurations are shipped as printed: what agrees is that readings and logic do what "
        "they say. The turns of Table 3.4 are those of |q| = sin(a/2)."
    )
    return Answer(checks, {"": picture()}, note)


def picture():
    """Which states of fine pointing follow from rate and |q|, Tables 3.2 to 3.4."""
    figure, (axes,) = new_figure("Fine pointing by rate and |q| (SDOT Tables 3.2 to 3.4)",
                                 height=4.2)  # fmt: skip
    s = SvrSettings()
    for x in (s.q_min, s.q_max):
        axes.axvline(x, color=GREY, lw=0.9, ls=(0, (5, 3)), zorder=1.5)
    for y in (s.rate_min_deg_s, s.rate_max_deg_s):
        axes.axhline(y, color=GREY, lw=0.9, ls=(0, (5, 3)), zorder=1.5)
    names = {(True, True): ("begins and stays", GREEN, "o"), (False, True): ("stays", BLUE, "s"),
             (False, False): ("ends", ORANGE, "x")}  # fmt: skip
    points: dict = {key: [] for key in names}
    for q in np.geomspace(0.006, 0.4, 13):
        for rate in np.geomspace(0.025, 0.55, 13):
            known = {"error_deg": 2.0 * math.degrees(math.asin(q)), "rate_deg_s": rate}
            points[acquired(**known) == "science", science(**known) == "science"].append((q, rate))
    for key, (name, colour, mark) in names.items():
        axes.plot(*zip(*points[key], strict=True), mark, color=colour, ms=5, label=name, ls="")
    axes.set(xscale="log", yscale="log", xlim=(0.005, 0.5), ylim=(0.02, 0.7))
    axes.set_xticks([0.01, 0.02, 0.05, 0.15, 0.4], ["0.01", "0.02", "0.05", "0.15", "0.4"])
    axes.set_yticks([0.03, 0.08, 0.2, 0.4], ["0.03", "0.08", "0.2", "0.4"])
    axes.minorticks_off()
    label(axes, "|q| of the turn from the orbital frame", "rate [deg/s]")
    return figure


ENTRY = Entry(
    ids=tuple(f"SDOT-3.{n}t" for n in range(1, 6)),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.REFUTED,
    reason=(
        "all numbers of the tables are those of the shipped sensors and logic; but a turn whose "
        "|q| is 0.15 is one of 17.3 deg, not of about 10: |q| = sin(a/2)"
    ),
    slow=True,
)
