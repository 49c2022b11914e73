"""A flight-like day of Chibis-M: the stages, their order and accuracy, and what a fault does."""

from pathlib import Path

import numpy as np
import pytest

from gallery import chibis_m
from gallery.chibis_m import (
    ACQUISITION,
    BDOT,
    DETUMBLING,
    MAG_DSS,
    MAG_WRATE,
    SCIENCE,
    TRIAD,
    WAITING,
)
from torquer import load_scenario, simulate
from torquer.compile import engine
from torquer.scenario.load import scenario_from_data

EXAMPLE = Path(__file__).parents[2] / "examples" / "chibis_m_day.toml"
compiled_only = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def without_checks(control):
    """Modes and laws of the gallery's day: the example checks sensors and coils besides."""
    regions = {name: control.modes.regions[name] for name in ("determination", "stabilisation")}
    plain = {"noise": None, "inertia_kg_m2": None, "regions": regions}
    laws = {name: law for name, law in control.laws.items() if name != "sdot"}
    modes = control.modes.model_copy(update=plain)
    return control.model_copy(update={"modes": modes, "laws": laws})


def test_the_example_is_the_day_of_the_gallery():
    example = load_scenario(EXAMPLE)
    same = {"description": "", "name": "chibis_m_day", "mission": None}
    same["control"] = without_checks(example.control)
    assert example.model_copy(update=same) == scenario_from_data(chibis_m.day())


@compiled_only
def test_sound_devices_are_not_suspected_and_checks_change_nothing():
    example = load_scenario(EXAMPLE).replace("simulation.duration_s", 4.0 * 3600.0)
    checked = simulate(example)
    for region in ("coils", "gyro", "coil_x", "coil_y", "coil_z", "sun"):
        assert not checked[f"mode_{region}"].values.any()
    plain = simulate(example.model_copy(update={"control": without_checks(example.control)}))
    for name in ("q_body_to_inertial", "omega_body", "command_body"):
        assert (checked[name].values == plain[name].values).all()


@compiled_only
def test_magnetometer_reading_of_no_number_does_not_reach_the_coils():
    """It is suspected at once, and the laws that read it are not called; S-dot takes over."""
    failures = [{"kind": "nan", "from_s": 603.0}]
    example = load_scenario(EXAMPLE).replace("spacecraft.magnetometer.failures", failures)
    result = simulate(example.replace("simulation.duration_s", 3000.0))
    by_field, idle, by_sun = range(3)
    coils, t = result["mode_coils"].values, result.time.values
    assert set(coils[t <= 600.0]) == {by_field} and set(coils[t >= 610.0]) == {idle, by_sun}
    assert np.abs(result.command_body.values[coils == idle][1:]).max() == 0.0
    assert set(result.mode_determination.values) == {BDOT}  # the rate is unknown, not zero


def flown(hours, **changes):
    data = chibis_m.day()
    data["simulation"]["duration_s"] = 3600.0 * hours
    for key, value in changes.items():
        data["spacecraft"][key] |= value
    return chibis_m.flown(scenario_from_data(data))


@pytest.fixture(scope="module")
def day():
    return flown(24.0)


@compiled_only
def test_stages_follow_one_another(day):
    first = [day.first_s(day.determination, s) for s in (BDOT, WAITING, TRIAD, MAG_DSS, MAG_WRATE)]
    assert first[0] == 0.0 and np.all(np.diff(first) > 0.0) and np.isfinite(first[-1])
    wheels = day.first_s(day.stabilisation, ACQUISITION)
    assert first[2] <= wheels <= first[2] + 10.0
    assert first[3] < day.first_s(day.stabilisation, SCIENCE) < wheels + 1500.0
    began = day.t_s >= day.first_s(day.stabilisation, SCIENCE)
    assert set(day.stabilisation[began]) == {SCIENCE}
    assert set(day.determination[began]) == {MAG_DSS, MAG_WRATE}


@compiled_only
def test_sun_sensors_are_used_in_light_and_never_in_shadow(day):
    """But for the 5 s of a switch; blind zones cost some of the light."""
    dark = day.sunlit_fraction < 0.1
    after = np.concatenate([[False], dark[:-1] & dark[1:]])
    assert not np.any(day.determination[after] == MAG_DSS)
    sunlit_fraction = (day.sunlit_fraction > 0.9) & (day.stabilisation == SCIENCE)
    assert np.mean(day.determination[sunlit_fraction] == MAG_DSS) > 0.6


@compiled_only
def test_rates_and_angles_of_each_stage(day):
    size = np.linalg.norm(day.rate_deg_s, axis=1)
    assert size[0] > 5.0
    damped = (day.stabilisation == ACQUISITION).argmax()
    assert size[damped] < 1.0
    wheels = (day.stabilisation == ACQUISITION) & (day.determination != TRIAD)
    assert size[wheels].max() < 0.35  # greatest_rate_deg_s of 0.25, with errors of estimate
    late = (day.stabilisation == SCIENCE) & (day.t_s > 7200.0)
    assert size[late].max() < 0.1


@compiled_only
def test_accuracy_in_light_and_shadow(day):
    """In the light below 1 deg (MAG: wheels hold better than 1 deg); without it drifts."""
    changed = np.concatenate([[0], np.cumsum(np.diff(day.determination) != 0)])
    since = day.t_s - np.array([day.t_s[changed == k][0] for k in range(changed[-1] + 1)])[changed]
    science = (day.stabilisation == SCIENCE) & (since >= 300.0)
    light, dark = science & (day.determination == MAG_DSS), science & (day.sunlit_fraction < 0.1)
    error = day.estimate_error_deg
    assert np.percentile(error[light], 95) < 0.3
    assert np.percentile(day.error_deg[light], 95) < 1.0
    assert 1.0 < np.percentile(error[dark], 95) < 10.0


@compiled_only
def test_the_filters_know_how_wrong_they_are(day):
    """Errors about all axes over the stated standard deviation: 3 in the mean, were they honest."""
    late = (day.stabilisation == SCIENCE) & (day.t_s > 7200.0)
    for state in (MAG_DSS, MAG_WRATE):
        there = late & (day.determination == state)
        ratio = (day.estimate_error_deg[there] / day.sigma_deg[there]) ** 2
        assert 0.3 < np.median(ratio) < 12.0


@compiled_only
def test_without_sun_sensors_it_never_points():
    """TRIAD needs them: B-dot goes on, and keeps the satellite slow."""
    course = flown(6.0, sun_sensors={"half_field_deg": 0.1})
    assert set(course.determination) == {BDOT, WAITING}
    assert set(course.stabilisation) == {DETUMBLING}
    assert np.linalg.norm(course.rate_deg_s, axis=1)[-1] < 0.5
