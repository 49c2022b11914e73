"""Likely slips of units are reported, and ordinary satellites are left alone."""

import math
from pathlib import Path

import pytest

from torquer.analysis.notes.device_notes import device_notes
from torquer.analysis.notes.reach_notes import reach_notes
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.base.user_code import admit
from torquer.scenario.load import load_scenario, scenario_from_text

ROOT = Path(__file__).parents[3]
BODY = "spacecraft.body.inertia_kg_m2"
AXES = [[1, 0, 0], [0, 1, 0], [1, 1, 0]]


def quaternion(*q):
    return {"initial": {"quaternion": list(q), "rate_deg_s": [1.0, -0.6, 0.8]}}


SLIPS = [
    ({"orbit.altitude_km": 80.0}, ["orbit: the altitude is 80 km: below 120 km"]),
    ({"orbit.altitude_km": 500000.0}, ["or is it 500 km in metres?"]),
    ({"orbit.altitude_km": 60000.0}, ["far beyond the geostationary orbit's 35786 km"]),
    # a 3U CubeSat's 0.03 kg m^2 in g cm^2
    ({BODY: [3e5, 3e5, 1e5], "spacecraft.coils.limit_a_m2": 0.2},
     [f"{BODY} of 3e+05 is too large for coils of 0.2 A m^2"]),
    ({"spacecraft.coils.axes": [[1, 0, 0], [1, 0, 0.001], [0, 1, 0]]},
     ["they cannot act along this axis: coils 0 and 1 are parallel"]),
    ({"spacecraft.coils.axes": AXES}, ["the 3 coils reach 0 A m^2 along [0.0, 0.0, 1.0] in the "]),
    ({"spacecraft.coils.lag_s": 3.0, "control.sample_s": 2.0},
     ["lag_s of 3 s is longer than the 2 s for which a command is held"]),
    ({"spacecraft.coils.lag_s": 3.0, "control.sample_s": 5.0}, []),
    ({"spacecraft.coils.lag_s": 3.0, "control.sample_s": 5.0, "control.measure_s": 5.0,
      "control.actuate_s": 2.0}, ["longer than the 2 s"]),
    ({"spacecraft.coils.axes": [[1, 0, 0], [0, 1, 0]]}, []),  # two coils are meant to be two
    ({"spacecraft.coils": None, BODY: [3e5, 3e5, 1e5]}, []),
    ({"spacecraft.magnetometer.noise_nt": 1e-7}, ["noise_nt of 1e-07 nT is below that of any"]),
    ({"spacecraft.magnetometer.noise_nt": 0.0}, []),
    ({"spacecraft.magnetometer.range_nt": 1e4}, ["range_nt of 10000 nT is exceeded on this orbit"]),
    ({"spacecraft.magnetometer.range_nt": 7e4}, []),
    ({"spacecraft.magnetometer.noise_nt": 6e4}, ["noise_nt of 60000 nT is "]),
    ({"spacecraft.magnetometer.misalignment_deg": [0, 0, 180]},
     ["spacecraft.magnetometer.misalignment_deg of 180 deg is not an error of mounting"]),
    ({"spacecraft.gyro.misalignment_deg": [0, 0, 19]}, []),
    ({"spacecraft.coils.residual_dipole_a_m2": [15, 0, 0]},
     ["spacecraft.coils.residual_dipole_a_m2 of 15 A m^2 exceeds the 3 A m^2 of a coil"]),
    ({"spacecraft.coils.limit_a_m2": 3e-3}, ["is too large for coils of 0.003 A m^2"]),
    ({"spacecraft.coils.limit_a_m2": 3e3}, ["limit_a_m2 of 3000 is very large for a moment"]),
    ({"mission": {"rate_below_deg_s": 50.0}}, ["above the initial rate of"]),
    ({"mission": {"rate_below_deg_s": 1e-9}}, ["mission.rate_below_deg_s of 1e-09 deg/s is less"]),
    ({"orbit.inclination_deg": 0.9}, ["a nearly equatorial orbit: or is it 51.6 deg in radians?"]),
    ({"orbit.inclination_deg": 0.0}, []),
    (quaternion(1, 0, 0, 0), ["initial.quaternion of [1, 0, 0, 0] is half a turn about x: the "
                              "scalar is last here, and [0, 0, 0, 1] is no rotation"]),
    (quaternion(-1, 0, 0, 0), ["initial.quaternion of [-1, 0, 0, 0] is half a turn about x"]),
    (quaternion(0.995, 0.0, math.sqrt(1 - 0.995**2), 0), ["is nearly half a turn about x: the"]),
    (quaternion(0, 0, 0, 1), []),
    (quaternion(0, 0, 0, -1), []),
    (quaternion(0, 1, 0, 0), []),
    (quaternion(0.6, 0, 0, 0.8), []),
    ({"simulation": {"duration_s": 4.0, "record_s": 2.0}, "control.sample_s": 2.0},
     ["simulation: the run of 4 s ends after 2 control steps of 2 s"]),
]  # fmt: skip


def notes_of(scenario):
    """Notes on numbers, on devices and on what actuators can do."""
    return [*slip_notes(scenario), *device_notes(scenario), *reach_notes(scenario)]


@pytest.mark.parametrize(("change", "expected"), SLIPS)
def test_a_slip_is_reported(make, change, expected):
    notes = notes_of(make(change))
    assert len(notes) == len(expected)
    assert all(part in note for part, note in zip(expected, notes, strict=True))


#: Every way to type elements, but for the inclination.
TYPED = [
    {"kind": "circular", "altitude_km": 500.0},
    {"kind": "kepler", "perigee_altitude_km": 500.0, "apogee_altitude_km": 600.0},
    {"kind": "drifting", "altitude_km": 500.0},
]


@pytest.mark.parametrize("orbit", TYPED, ids=lambda orbit: orbit["kind"])
def test_an_inclination_in_radians_is_reported_in_every_kind_of_elements(make, orbit):
    (note,) = slip_notes(make({"orbit": orbit | {"inclination_deg": 0.9}}))
    assert "or is it 51.6 deg in radians?" in note
    assert slip_notes(make({"orbit": orbit | {"inclination_deg": 51.6}})) == []


def test_a_derived_inclination_is_no_slip(make):
    assert slip_notes(make({"orbit": TYPED[-1] | {"ltan_h": 10.5}})) == []


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda p: p.stem)
def test_the_examples_have_no_slips(path):
    assert notes_of(load_scenario(path)) == []


@pytest.mark.parametrize(
    ("inertia", "limit"),
    [("[77217, 77000, 40000]", 3600.0), ("[0.002, 0.002, 0.002]", 0.05), ("[1.7, 1.3, 1]", 3.2)],
    ids=["Hubble", "1U", "Chibis-M"],
)
def test_real_satellites_are_left_alone(inertia, limit):
    scenario = scenario_from_text(
        f"""
start = 2025-07-01T00:00:00Z
orbit = {{ kind = "circular", altitude_km = 540, inclination_deg = 28.5 }}
spacecraft.body.inertia_kg_m2 = {inertia}
spacecraft.coils.limit_a_m2 = {limit}
initial.rate_deg_s = [0, 0, 0]
control.law.kind = "off"
simulation = {{ revolutions = 1 }}
"""
    )
    assert notes_of(scenario) == []


OWN_FIELD = """
import numpy as np


def field(r_ecef_m, years, unit=1.0, sign=1.0, local=0.0):
    distance = np.linalg.norm(r_ecef_m, axis=1)[:, None]
    up = r_ecef_m / distance
    moment = sign * np.array([0.4e15, -1.3e15, -7.7e15])
    b = unit * (3.0 * up * (up @ moment)[:, None] - moment) / distance**3
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east, axis=1)[:, None]
    axes = (np.cross(up, east), east, -up)
    return np.stack([np.sum(b * each, axis=1) for each in axes], axis=1) if local else b
"""


@pytest.mark.parametrize("inclination_deg", (30.0, 97.6))
@pytest.mark.parametrize(
    ("parameters", "expected"),
    (
        ({}, ""),
        ({"unit": 2.0}, ""),  # a storm is weaker
        ({"unit": 1e4}, "times the Earth's dipole: is it in tesla"),
        ({"unit": 1e-3}, "times the Earth's dipole: is it in tesla"),
        ({"local": 1.0}, "is it in Earth-fixed axes, not north, east and down?"),
        ({"sign": -1.0}, "deg off that of the Earth's dipole"),
    ),
)
def test_an_own_field_is_in_tesla_and_earth_fixed(tmp_path, inclination_deg, parameters, expected):
    """A field in gauss is below the greatest that is refused; axes are not seen at all."""
    (tmp_path / "own.py").write_text(OWN_FIELD)
    field = {"kind": "user", "file": str(tmp_path / "own.py"), "parameters": parameters}
    scenario = load_scenario(ROOT / "examples/chibis_m_detumble.toml").replace(
        "orbit", {"kind": "circular", "altitude_km": 520.0, "inclination_deg": inclination_deg}
    )
    flown = scenario.replace("environment.field", field)
    admit(flown)
    found = [note for note in slip_notes(flown) if "environment.field" in note]
    assert len(found) == (1 if expected else 0)
    assert all(expected in note for note in found)
