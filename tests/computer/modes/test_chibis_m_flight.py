"""All modes of Chibis-M's flight software: each transition of each table taken, second by second.

Source: SDOT 3.3, 3.4, Figs. 3.18 to 3.21, Tables 3.3 to 3.5.
"""

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from flown_modes import Flown, reading

from torquer import load_scenario
from torquer.computer.interface import SENSORS
from torquer.computer.modes.graph import find_edges

EXAMPLE = Path(__file__).parents[3] / "examples" / "chibis_m_flight.toml"
SCENARIO = load_scenario(EXAMPLE)
MODES = SCENARIO.control.modes
#: Guards that are shipped and tested by themselves.
GUARDS = ("coil_x", "coil_y", "coil_z")
#: Those and the last one on the rate.
OF_PRESETS = (*GUARDS, "spin")
#: The other regions while an edge is tried, unless it says otherwise.
CALM = {name: region.initial for name, region in MODES.regions.items()}
KNOWN = {"sun": True, "angle": 90.0, "error": 90.0, "rate": 0.5, "sigma": 20.0, "age": 0.0}

bdot, waiting, triad, sdot = "bdot", "waiting", "triad", "sdot"
dss, wrate, all_three, dss_wrate = (
    "kalman_mag_dss", "kalman_mag_wrate", "kalman_mag_dss_wrate", "kalman_dss_wrate",
)  # fmt: skip
MAG, GYRO, SUN = {"magnetometer": "magnetometer_lost"}, {"gyro": "gyro_lost"}, {"sun": "sun_lost"}
FAILED, LOST = {"wheels": "wheels_failed"}, {"wheels": "wheels_lost"}
OFF = {f"coil_{axis}": "off" for axis in "xyz"}


def aos(state):
    """Determination in a state."""
    return {"determination": state}


#: Region, state left, state entered, what must be so, and for how long [s]: of the other regions
#: (a dict), of what is measured and estimated (by keys), of flags and suspicions. Figures are the
#: source's, or those of `chibis_m_determination`.
EDGES = [
    ("supervisor", "manual", "automatic", {}, {"flags": ["anomaly"]}, 0),
    # The base: left in automatic mode with a magnetometer and wheels, or without Sun sensors.
    ("determination", sdot, bdot, {}, {}, 120),
    ("determination", sdot, bdot, FAILED | SUN, {}, 120),
    ("determination", sdot, bdot, FAILED, {"angle": 101.0}, 3600),
    ("determination", sdot, bdot, LOST | {"supervisor": "manual"}, {"rate": 2.1}, 120),
    ("determination", bdot, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", bdot, sdot, MAG, {}, 0),
    ("determination", bdot, waiting, {}, {"rate": 0.39}, 300),
    ("determination", waiting, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", waiting, sdot, MAG, {}, 0),
    ("determination", waiting, bdot, {}, {"rate": 0.61, "sun": False}, 30),
    ("determination", waiting, sdot, FAILED, {"rate": 0.19}, 300),
    ("determination", waiting, sdot, LOST, {"rate": 0.19}, 300),
    ("determination", waiting, triad, {}, {}, 10),
    ("determination", waiting, dss, GYRO, {}, 10),
    ("determination", waiting, wrate, SUN, {}, 60),
    ("determination", triad, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", triad, sdot, MAG, {}, 0),
    ("determination", triad, sdot, FAILED, {}, 0),
    ("determination", triad, sdot, LOST, {}, 0),
    ("determination", triad, dss, {}, {"error": 59.0}, 10),
    ("determination", triad, dss, GYRO, {}, 10),
    ("determination", triad, waiting, SUN, {}, 0),
    ("determination", triad, waiting, {}, {"age": 10.5}, 0),
    ("determination", triad, bdot, {}, {"rate": 0.61}, 10),
    ("determination", dss, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", dss, sdot, FAILED, {}, 0),
    ("determination", dss, sdot, LOST, {}, 0),
    ("determination", dss, dss_wrate, MAG, {}, 0),
    ("determination", dss, sdot, MAG | GYRO, {}, 0),
    ("determination", dss, wrate, {}, {"sun": False, "sigma": 9.9}, 5),
    ("determination", dss, wrate, SUN, {}, 0),
    ("determination", dss, waiting, SUN | GYRO, {}, 0),
    ("determination", dss, triad, {}, {"sigma": 10.1}, 0),
    ("determination", dss, waiting, GYRO, {"sigma": 10.1}, 600),
    ("determination", dss, waiting, {}, {"sigma": 9.9, "age": 10.5}, 0),
    ("determination", dss, bdot, {}, {"sigma": 9.9, "rate": 0.61}, 30),
    ("determination", all_three, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", all_three, sdot, FAILED, {}, 0),
    ("determination", all_three, sdot, LOST, {}, 0),
    ("determination", all_three, dss_wrate, MAG, {}, 0),
    ("determination", all_three, sdot, MAG | GYRO, {}, 0),
    ("determination", all_three, wrate, {}, {"sun": False, "sigma": 9.9}, 5),
    ("determination", all_three, wrate, SUN, {}, 0),
    ("determination", all_three, dss, GYRO, {}, 0),
    ("determination", all_three, triad, {}, {"sigma": 10.1}, 0),
    ("determination", all_three, waiting, {}, {"sigma": 9.9, "age": 10.5}, 0),
    ("determination", all_three, bdot, {}, {"sigma": 9.9, "rate": 0.61}, 30),
    ("determination", wrate, sdot, {}, {"flags": ["anomaly"]}, 0),
    ("determination", wrate, sdot, FAILED, {}, 0),
    ("determination", wrate, sdot, LOST, {}, 0),
    ("determination", wrate, dss_wrate, MAG, {}, 0),
    ("determination", wrate, sdot, MAG | SUN, {}, 0),
    ("determination", wrate, dss, {}, {"sigma": 9.9}, 5),
    ("determination", wrate, dss, GYRO, {"sun": False, "sigma": 9.9}, 5),
    ("determination", wrate, waiting, GYRO | SUN, {}, 0),
    ("determination", wrate, triad, {}, {"sun": False, "sigma": 10.1}, 0),
    ("determination", wrate, waiting, {}, {"sun": False, "sigma": 9.9, "age": 10.5}, 10),
    ("determination", wrate, bdot, {}, {"sun": False, "sigma": 9.9, "rate": 0.61}, 30),
    ("determination", dss_wrate, sdot, MAG, {"flags": ["anomaly"]}, 0),
    ("determination", dss_wrate, sdot, MAG | FAILED, {}, 0),
    ("determination", dss_wrate, sdot, MAG | LOST, {}, 0),
    ("determination", dss_wrate, wrate, {}, {}, 10),
    ("determination", dss_wrate, sdot, MAG | GYRO, {}, 0),
    ("determination", dss_wrate, sdot, MAG | SUN, {}, 0),
    ("determination", dss_wrate, sdot, MAG, {"sigma": 46.0}, 0),
    ("determination", dss_wrate, sdot, MAG, {"age": 10.5}, 0),
    ("determination", dss_wrate, sdot, MAG, {"rate": 0.61}, 30),
    ("stabilisation", "safe", "detumbling", aos(bdot), {}, 10),
    ("stabilisation", "safe", "safe_reversed", {"capture": "wrong_way"}, {}, 10),
    ("stabilisation", "safe", "safe_spin_up", {}, {"rate": 0.39, "angle": 59.0}, 300),
    ("stabilisation", "safe_spin_up", "detumbling", aos(bdot), {}, 0),
    ("stabilisation", "safe_spin_up", "safe", MAG, {}, 0),
    ("stabilisation", "safe_spin_up", "safe", aos("aos_off"), {}, 0),
    ("stabilisation", "safe_spin_up", "safe", {}, {"angle": 91.0}, 0),
    ("stabilisation", "safe_spin_up", "safe", {}, {"angle": 50.0, "rate": 0.91}, 10),
    ("stabilisation", "safe_spin_up", "safe", {}, {"angle": 50.0}, 900),
    ("stabilisation", "safe_reversed", "detumbling", aos(bdot), {}, 0),
    ("stabilisation", "safe_reversed", "safe", {}, {}, 0),
    ("stabilisation", "safe_reversed", "safe", aos("aos_off") | {"capture": "wrong_way"}, {}, 0),
    ("stabilisation", "detumbling", "safe", aos(sdot), {}, 0),
    ("stabilisation", "detumbling", "safe", aos("aos_off"), {}, 0),
    ("stabilisation", "detumbling", "acquisition", aos(triad), {"sigma": 9.9}, 5),
    *[
        ("stabilisation", state, *way, {}, 0)
        for state in ("acquisition", "science", "point2dir", "one_axis")
        for way in (
            ("safe", aos(sdot)),
            ("safe", aos("aos_off")),
            ("detumbling", aos(bdot)),
            ("detumbling", aos(waiting)),
        )
    ],
    # Tables 3.3 and 3.4: |q| below 0.02 is 2.3 deg, above 0.15 17.2 deg.
    ("stabilisation", "acquisition", "science", aos(dss), {"error": 2.29, "rate": 0.079}, 60),
    ("stabilisation", "science", "acquisition", aos(dss), {"error": 17.3, "rate": 0.05}, 0),
    ("stabilisation", "science", "acquisition", aos(dss), {"error": 1.0, "rate": 0.41}, 0),
    ("stabilisation", "point2dir", "acquisition", aos(triad), {}, 0),
    ("stabilisation", "point2dir", "one_axis", aos(dss), {"rate": 0.079}, 120),
    ("stabilisation", "point2dir", "one_axis", aos(dss), {}, 900),
    ("stabilisation", "one_axis", "acquisition", aos(triad), {}, 0),
    ("stabilisation", "one_axis", "acquisition", aos(dss), {"rate": 0.41}, 0),
    # Table 3.5.
    ("actuators", "stb_tw", "stb_00", aos("aos_off"), {}, 0),
    ("actuators", "stb_tw", "stb_0t", FAILED, {}, 0),
    ("actuators", "stb_tw", "stb_0t", LOST, {}, 0),
    ("actuators", "stb_tw", "stb_0w", {"coils": "coils_lost"}, {}, 0),
    ("actuators", "stb_0t", "stb_00", aos("aos_off"), {}, 0),
    ("actuators", "stb_0t", "stb_00", FAILED | {"coils": "coils_lost"}, {}, 0),
    ("actuators", "stb_0t", "stb_tw", {}, {}, 10),
    ("actuators", "stb_0w", "stb_00", aos("aos_off"), {}, 0),
    ("actuators", "stb_0w", "stb_00", FAILED | {"coils": "coils_lost"}, {}, 0),
    ("actuators", "stb_0w", "stb_00", LOST | {"coils": "coils_lost"}, {}, 0),
    ("actuators", "stb_0w", "stb_tw", {}, {}, 10),
    ("actuators", "stb_00", "stb_0t", FAILED, {}, 10),
    ("actuators", "stb_00", "stb_0w", {"coils": "coils_lost"}, {}, 10),
    *[
        ("wheels", state, "wheels_lost", {}, {"flags": [flag]}, 0)
        for state in ("wheels_usable", "wheels_tried", "wheels_failed")
        for flag in ("wheel_x_lost", "wheel_y_lost", "wheel_z_lost", "wheels_lost")
    ],
    ("wheels", "wheels_usable", "wheels_failed", {}, {"momentum": 0.031}, 300),
    ("wheels", "wheels_usable", "wheels_tried", {"stabilisation": "acquisition"}, {}, 0),
    ("wheels", "wheels_tried", "wheels_failed", aos(dss), {"momentum": 0.031}, 300),
    ("wheels", "wheels_tried", "wheels_usable", aos(dss) | {"stabilisation": "science"}, {}, 300),
    ("wheels", "wheels_tried", "wheels_usable", {}, {}, 10),  # S-dot: the attempt proves nothing
    ("wheels", "wheels_tried", "wheels_failed", aos(dss) | {"stabilisation": "acquisition"}, {},
     1500),
    ("wheels", "wheels_tried", "wheels_failed", aos(bdot), {}, 7200),
    ("wheels", "wheels_failed", "wheels_usable", {}, {}, 3600),
    ("wheels", "wheels_lost", "wheels_usable", {}, {}, 60),
    ("coils", "coils_usable", "coils_lost", {}, {"flags": ["coils_lost"]}, 0),
    ("coils", "coils_usable", "coils_lost", OFF, {}, 0),
    *[("coils", "coils_lost", "coils_usable", OFF | {g: "in_use"}, {}, 10) for g in GUARDS],
    *[
        edge
        for name, sensor in (("magnetometer", "magnetometer"), ("gyro", "gyro"),
                             ("sun", "sun_sensors"))
        for edge in (
            (name, f"{name}_known", f"{name}_lost", {}, {"suspects": [sensor]}, 0),
            (name, f"{name}_known", f"{name}_lost", {}, {"flags": [f"{name}_lost"]}, 0),
            (name, f"{name}_lost", f"{name}_known", {}, {}, 600),
        )
    ],
    ("sun", "sun_known", "sun_lost", {}, {"sun": False}, 6000),
    ("capture", "watching", "wrong_way", {}, {"angle": 161.0}, 3600),
    ("capture", "wrong_way", "watching", {}, {}, 600),
]  # fmt: skip


def floating(angle_deg):
    """A unit vector so far from the third axis [deg]."""
    return (math.sin(math.radians(angle_deg)), 0.0, math.cos(math.radians(angle_deg)))


class Table(Flown):
    """The tables of the example: one region is free, all others are where they are put.

    The wanted attitude is one in the inertial frame, to which a rate is then relative.
    """

    def __init__(self):
        attitude = MODES.attitude.model_copy(update={"reference": "inertial"})
        self.modes = MODES.model_copy(update={"attitude": attitude})
        self.places = [(name, state) for name, r in MODES.regions.items() for state in r.states]
        control = SCENARIO.control
        names = ["none", *control.estimators]
        self.table, self.state = self.modes.pack(
            {law: k for k, law in enumerate(control.laws)}, {e: k for k, e in enumerate(names)}
        )
        self.t_s = 0.0
        self(self.seen({}))

    def put(self, region, state):
        """A region has entered a state just now."""
        number, place = [*MODES.regions].index(region), self.places.index((region, state))
        now = self.state.regions[number]
        if now["state"] != place:
            now["state"], now["since_s"] = place, self.t_s
            self.state.states[place]["entries"] = 1.0

    def now_in(self, region):
        """The state of a region."""
        number = [*MODES.regions].index(region)
        return self.places[int(self.state.regions["state"][number])][1]

    def seen(self, known):
        """What the computer knows, and what is flagged and suspected."""
        known = KNOWN | known
        half = math.radians(0.5 * known["error"])
        self.state.flags[:] = [flag in known.get("flags", ()) for flag in MODES.flags]
        for number, sensor in enumerate(SENSORS):
            suspected = sensor in known.get("suspects", ())
            self.state.sensors["failed_s"][number] = self.t_s if suspected else -math.inf
        seen = reading(
            self.t_s,
            sun=floating(known["angle"]) if known["sun"] else (0.0, 0.0, 0.0),
            wheels=(known.get("momentum", 0.0), 0.0, 0.0),
            q_body_to_inertial=(math.sin(half), 0.0, 0.0, math.cos(half)),
            omega_body_rad_s=(0.0, math.radians(known["rate"]), 0.0),
            sigma_rad=math.radians(known["sigma"]),
        )
        return seen._replace(estimate=seen.estimate._replace(t_s=self.t_s - known["age"]))

    def left_after_s(self, region, state, others, known, longest_s):
        """(Time [s] after which the region leaves a state, state that it enters)."""
        for name, there in (CALM | others | {region: state}).items():
            self.put(name, there)
        began_s = self.t_s
        while self.t_s <= began_s + longest_s:
            self.t_s += 1.0
            self(self.seen(known))
            if self.now_in(region) != state:
                return self.t_s - began_s, self.now_in(region)
            for name, there in (CALM | others).items():
                if name != region:
                    self.put(name, there)
        return math.inf, state


@pytest.mark.verifies("REQ-SVR-010")
@pytest.mark.parametrize("number", range(len(EDGES)))
def test_each_transition_is_taken_when_it_is_to_be(number):
    """And one that needs a time not before."""
    region, leave, to, others, known, time_s = EDGES[number]
    after_s, entered = Table().left_after_s(region, leave, others, known, time_s + 5.0)
    assert entered == to
    assert time_s <= after_s <= time_s + 2.0


@pytest.mark.verifies("REQ-SVR-010")
def test_no_transition_is_left_out():
    """The tables have no transitions but those that are taken above."""
    of_times = Counter()  # a condition and at_most_s are two ways to take one transition
    for name, region in MODES.regions.items():
        for edge in find_edges(region) if name not in OF_PRESETS else []:
            assert not edge.from_any
            both = bool(edge.transition.when) and edge.transition.at_most_s is not None
            of_times[name, edge.leave, edge.to] += 2 if both else 1
    assert of_times == Counter((region, leave, to) for region, leave, to, *_ in EDGES)


@pytest.mark.parametrize(
    ("region", "state", "others", "known"),
    [
        ("supervisor", "automatic", {}, {"flags": ["anomaly"]}),
        ("supervisor", "manual", {}, {}),
        ("determination", "aos_off", {}, {"flags": ["anomaly"]}),  # waits for the ground
        ("determination", sdot, {}, {"flags": ["anomaly"]}),
        ("determination", sdot, {"supervisor": "manual"}, {"angle": 101.0}),
        ("determination", sdot, MAG, {"rate": 3.0}),
        ("determination", sdot, LOST, {"angle": 99.0, "rate": 1.9}),  # the end of life
        ("determination", bdot, {}, {"rate": 0.41}),
        ("determination", bdot, FAILED, {}),
        ("determination", waiting, {}, {"sun": False}),
        ("determination", waiting, FAILED, {"rate": 0.21}),
        ("determination", waiting, SUN | GYRO, {}),
        ("determination", triad, {}, {"error": 61.0}),
        ("determination", dss, {}, {"sigma": 9.9, "age": 9.5, "rate": 0.59}),
        ("determination", dss, GYRO, {"sun": False, "sigma": 9.9}),
        ("determination", wrate, {}, {"sun": False, "sigma": 9.9, "age": 9.5, "rate": 0.59}),
        ("determination", wrate, SUN, {"sigma": 60.0}),  # until the field has shown the attitude
        ("determination", dss_wrate, MAG, {"sun": False, "sigma": 44.0, "age": 9.5, "rate": 0.59}),
        ("stabilisation", "safe", {}, {"rate": 0.41, "angle": 50.0}),
        ("stabilisation", "safe", {}, {"rate": 0.1, "angle": 61.0}),
        ("stabilisation", "detumbling", aos(wrate), {"sigma": 11.0}),
        ("stabilisation", "acquisition", aos(dss), {"error": 2.31, "rate": 0.079}),
        ("stabilisation", "acquisition", aos(dss), {"error": 2.29, "rate": 0.081}),
        ("stabilisation", "science", aos(dss), {"error": 17.1, "rate": 0.39}),
        ("stabilisation", "one_axis", aos(dss), {"error": 170.0, "rate": 0.39}),
        ("actuators", "stb_00", aos("aos_off"), {}),
        ("wheels", "wheels_usable", {"stabilisation": "science"}, {"momentum": 0.029}),
        ("wheels", "wheels_lost", {}, {"flags": ["wheel_y_lost"]}),
        ("coils", "coils_lost", {}, {"flags": ["coils_lost"]}),
        ("magnetometer", "magnetometer_lost", {}, {"flags": ["magnetometer_lost"]}),
        ("gyro", "gyro_lost", {}, {"suspects": ["gyro"]}),
        ("sun", "sun_lost", {}, {"sun": False}),
    ],
)
def test_state_is_kept_beyond_the_other_side_of_a_limit(region, state, others, known):
    assert Table().left_after_s(region, state, others, known, 4000.0)[1] == state


def test_wheels_that_fail_again_and_again_are_given_up():
    """A pause of an hour, one of four, and then none ends any more."""
    table, paused_s = Table(), []
    table.left_after_s("wheels", "wheels_tried", aos(bdot), {}, 8000.0)
    for _ in range(3):
        began_s, longest_s = table.t_s, 40000.0
        while table.now_in("wheels") == "wheels_failed" and table.t_s < began_s + longest_s:
            table.t_s += 10.0
            table(table.seen({}))
            for name, state in (CALM | aos(bdot)).items():
                if name != "wheels":
                    table.put(name, state)
        paused_s.append(table.t_s - began_s)
        if table.now_in("wheels") == "wheels_usable":
            table.put("wheels", "wheels_tried")
            entries = table.state.states[table.places.index(("wheels", "wheels_failed"))]["entries"]
            assert entries == len(paused_s)
            table.left_after_s("wheels", "wheels_tried", aos(bdot), {}, 8000.0)
    assert paused_s == pytest.approx([3600.0, 14400.0, 40000.0], abs=20.0)


def test_thresholds_that_the_source_lets_the_ground_change_have_names():
    found = {c.threshold: c for _, c in MODES.all_conditions() if c.threshold}
    values = {
        name: c.above if c.below is None else c.below for name, c in found.items()
    }  # fmt: skip
    assert values == {
        "rate_max": 0.4, "rate_min": 0.08, "angle_max": 17.2, "angle_min": 2.3,
        "slow": 0.4, "fast": 0.6, "filter_from": 60.0, "accuracy": 10.0,
    }  # fmt: skip
    for name, q in (("angle_max", 0.15), ("angle_min", 0.02)):
        assert 2.0 * np.degrees(np.arcsin(q)) == pytest.approx(values[name], abs=0.06)
