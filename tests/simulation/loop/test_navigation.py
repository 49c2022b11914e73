"""What a law knows of attitude and orbit: the truth of the models, if it asks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.computer.blocks.law import Law

SCENARIO = """
start = 2025-03-01T00:00:00Z
[orbit]
kind = "kepler"
perigee_altitude_km = 400
apogee_altitude_km = 900
inclination_deg = 63.0
[spacecraft.body]
inertia_kg_m2 = [1.0, 1.5, 1.8]
[spacecraft.coils]
limit_a_m2 = 1.0
[initial]
rate_deg_s = [1.0, 2.0, -1.0]
[control]
law = { kind = "off" }
[simulation]
duration_s = 600
record_s = 60
"""


def watched(*needs):
    """What a law in plain Python received, at every second, and the run's result."""
    seen = []

    def watch(inputs, parameters, memory):
        seen.append(inputs)
        return (0.0, 0.0, 0.0)

    law = Law("watch", watch, needs=frozenset(needs), compiled=False)
    result = torquer.simulate(torquer.scenario_from_text(SCENARIO), law)
    return seen[::60], result


def rotation(inputs):
    return Rotation.from_quat(inputs.q_body_to_inertial).as_matrix()


def test_law_needing_the_ephemeris_knows_place_field_and_sun():
    seen, result = watched("ephemeris", "search_coil")
    for row, inputs in enumerate(seen[:10]):
        there, place = result.isel(time=row), inputs.ephemeris
        assert inputs.q_body_to_inertial == pytest.approx(
            tuple(there.q_body_to_inertial.values), abs=1e-15
        )
        r, v = np.array(place.r_inertial_m), np.array(place.v_inertial_m_s)
        assert np.linalg.norm(r - there.position_inertial.values) < 1e-9 * np.linalg.norm(r)
        b, b_rate = np.array(place.b_inertial_t), np.array(place.b_rate_inertial_t_s)
        assert np.linalg.norm(b - there.b_inertial.values) < 1e-9 * np.linalg.norm(b)
        seen = rotation(inputs) @ inputs.b_rate_body_t_s
        turned = b_rate - np.cross(rotation(inputs) @ inputs.omega_body_rad_s, b)
        assert seen == pytest.approx(turned, abs=1e-18)
        assert np.linalg.norm(v - there.velocity_inertial.values) < 1e-6 * np.linalg.norm(v)
        assert place.sun_inertial == pytest.approx(tuple(there.sun_inertial.values), abs=1e-9)
        assert place.sunlit_fraction == pytest.approx(float(there.sunlit_fraction), abs=1e-6)


@torquer.law(
    needs=("ephemeris",),
    memory={
        "r": (0, 0, 0),
        "v": (0, 0, 0),
        "b": (0, 0, 0),
        "sun": (0, 0, 0),
        "sunlit_fraction": 0.0,
    },
    log={"r": "m", "v": "m/s", "b": "T", "sun": "1", "sunlit_fraction": "1"},
)
def noting(inputs, parameters, memory):
    """Logs the ephemeris."""
    e = inputs.ephemeris
    for k in range(3):
        memory.r[k], memory.v[k], memory.b[k] = (
            e.r_inertial_m[k],
            e.v_inertial_m_s[k],
            e.b_inertial_t[k],
        )
        memory.sun[k] = e.sun_inertial[k]
    memory.sunlit_fraction = e.sunlit_fraction
    return (0.0, 0.0, 0.0)


DAY = SCENARIO.replace("63.0", "20.0").replace("duration_s = 600", "duration_s = 7200")
SUNS = {
    "": (None, True),
    "[environment]\nsun_direction = [0, 2, 0]\n": ((0.0, 1.0, 0.0), True),
    "[environment]\nsun_direction = [1, 0, 1]\neclipse = 'none'\n": (
        (0.5**0.5, 0, 0.5**0.5),
        False,
    ),
}


@pytest.mark.parametrize("environment", SUNS, ids=["true", "fixed", "fixed, no eclipse"])
def test_what_a_law_knows_is_what_the_result_tells(environment):
    """Through the shadow, with the Sun where it is or where it is held."""
    fixed, eclipses = SUNS[environment]
    result = torquer.simulate(torquer.scenario_from_text(DAY + environment), noting)
    result = result.isel(time=slice(0, -1))
    for name, variable in (("r", "position_inertial"), ("v", "velocity_inertial"),
                       ("b", "b_inertial"), ("sun", "sun_inertial")):  # fmt: skip
        size = np.abs(result[variable].values).max()
        away = np.abs(result[f"law.{name}"].values - result[variable].values).max()
        assert away < (1e-6 if name == "v" else 1e-8) * size, name
    sunlit_fraction = result["law.sunlit_fraction"].values
    assert sunlit_fraction == pytest.approx(result.sunlit_fraction.values, abs=1e-4)
    assert (sunlit_fraction.min() < 1e-9) == eclipses
    assert sunlit_fraction.max() == 1.0
    if fixed is not None:
        sun = result["law.sun"].values
        assert np.abs(sun - fixed).max() < 1e-4  # the parallax in a low orbit


def test_other_laws_get_no_note_about_where_they_are():
    seen, _ = watched()
    place = seen[3].ephemeris
    assert np.isnan([*place.r_inertial_m, *place.v_inertial_m_s, *place.b_inertial_t]).all()
    assert np.isnan([*place.b_rate_inertial_t_s, *place.sun_inertial, place.sunlit_fraction]).all()
    assert np.isfinite(seen[3].q_body_to_inertial).all()
