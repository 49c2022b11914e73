"""Hints name no key of another quantity, and convert between units of the same."""

import pytest

from torquer.base.units import UNITS, conversion, did_you_mean, near_names, unit_of
from torquer.scenario.keys import key_unit, specs_below
from torquer.scenario.spec import Scenario

GYRO = ["sample_s", "range_deg_s", "noise_deg_s", "bias_deg_s", "bias_drift_deg_s_sqrt_s"]


@pytest.mark.parametrize(
    ("name", "known", "hint"),
    [
        ("noise_deg_sqrt_h", GYRO,
         "noise_deg_s? It is the angle random walk in deg/sqrt(h) / 60 / sqrt(sample_s)"),
        ("noise_deg_sqrt_s", GYRO,
         "noise_deg_s? It is the angle random walk in deg/sqrt(s) / sqrt(sample_s)"),
        ("arw_deg_sqrt_h", GYRO,
         "noise_deg_s? It is the angle random walk in deg/sqrt(h) / 60 / sqrt(sample_s)"),
        ("noise_rad_s", GYRO, "noise_deg_s? 1 rad/s is 57.2958 deg/s"),
        ("bias_deg_h", GYRO, "bias_deg_s? 1 deg/h is 0.000277778 deg/s"),
        ("bias_drift_deg_h_sqrt_h", GYRO,
         "bias_drift_deg_s_sqrt_s? 1 deg/h/sqrt(h) is 4.62963e-06 deg/s/sqrt(s)"),
        ("sample_hz", GYRO, "sample_s? It is 1 over the frequency"),
        ("altitude_m", ["altitude_km"], "altitude_km? 1 m is 0.001 km"),
        ("noise_uT", ["noise_nt"], "noise_nt? 1 uT is 1000 nT"),
        ("limit_ma_m2", ["limit_a_m2"], "limit_a_m2? 1 mA m^2 is 0.001 A m^2"),
        ("inertia_g_cm2", ["inertia_kg_m2"], "inertia_kg_m2? 1 g cm^2 is 1e-07 kg m^2"),
        ("noise_dg_s", GYRO, "noise_deg_s?"),
        ("nois_deg_s", GYRO, "noise_deg_s?"),
        ("noise", GYRO, "noise_deg_s?"),
        ("limit_am2", ["limit_a_m2"], "limit_a_m2?"),
        ("noise_deg_s_sqrt_hz", ["noise_deg_s"], None),
        ("noise_nt_sqrt_hz", ["noise_nt"], None),
        ("wheel_momentum_n_m", ["wheel_momentum_n_m_s"], None),
        ("torque_limit_n_m_s", ["torque_limit_n_m"], None),
        ("rate_deg", ["rate_deg_s"], None),
        ("area_m", ["area_m2"], None),
        ("axis_m", ["axis"], None),
        ("noise_deg_s", ["range_deg_s"], None),
        ("range_deg_s", ["noise_deg_s"], None),
        ("range_rad_s", ["range_deg_s"], "range_deg_s? 1 rad/s is 57.2958 deg/s"),
    ],
)  # fmt: skip
def test_a_hint_has_the_same_unit_or_the_conversion(name, known, hint):
    assert did_you_mean(name, known) == ("" if hint is None else f" (did you mean {hint})")


def test_the_nearest_name_of_the_same_quantity_is_named_though_another_is_nearer():
    assert near_names("rate_n_m", ["rate_n_m_s", "rates_n_m"], 1) == ["rates_n_m"]


def test_options_keep_their_dashes():
    assert did_you_mean("altitude-m", ["altitude-km"], dashes="--") == (
        " (did you mean --altitude-km? 1 m is 0.001 km)"
    )


def spec_keys():
    """All keys of scenarios: whatever else has been imported, the same."""
    return sorted({key for spec in specs_below(Scenario) for key in spec.model_fields})


def test_every_key_has_here_the_unit_that_the_documentation_states():
    keys = spec_keys()
    assert {*Scenario.model_fields} <= {*keys} and len(keys) > 200
    for key in keys:
        # which do not end in their units
        if key not in ("b0", "held_at_year"):
            assert bool(unit_of(key)) == bool(key_unit(key)), key


@pytest.mark.parametrize("key", spec_keys())
def test_a_key_with_another_unit_is_never_proposed(key):
    """Every key with its unit replaced by every other: the hint converts, or there is none."""
    own = next((end for end in sorted(UNITS, key=len, reverse=True) if key.endswith(f"_{end}")), "")
    for end, unit in UNITS.items():
        name = f"{key.removesuffix(f'_{own}')}_{end}"
        if own and unit_of(name) == unit:
            hint = did_you_mean(name, [key])
            assert hint == "" or end == own or UNITS[own] == unit or conversion(name, key) in hint
            if unit.measures != UNITS[own].measures and hint:
                assert "angle random walk" in hint or "over the frequency" in hint
