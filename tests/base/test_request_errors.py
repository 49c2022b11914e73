"""Mistakes in requests: Python reads keys, the command line its options."""

from pathlib import Path

import numpy as np
import pytest

from torquer.analysis.field.requests import FieldConeRequest, FieldPointRequest
from torquer.base.limits import RequestError
from torquer.cli.options import option
from torquer.design.requests import CoilRequest, DetumbleRequest, ThreeAxisRequest


@pytest.mark.parametrize(
    ("error", "python", "command"),
    [
        (RequestError("step_s", "must divide the time"),
         "step_s: must divide the time", "--step-s: must divide the time"),
        (RequestError("date", "must be a date, or {points} must have one"),
         "date: must be a date, or points must have one",
         "--date: must be a date, or --points must have one"),
        (RequestError("voltage_v, current_a", "must allow more; received current_a 1"),
         "voltage_v, current_a: must allow more; received current_a 1",
         "--voltage-v, --current-a: must allow more; received --current-a 1"),
        (RequestError("points, line 3: alt_km", "must lie within 0..1"),
         "points, line 3: alt_km: must lie within 0..1",
         "--points, line 3: alt_km: must lie within 0..1"),
        (RequestError("control.sample_s", "must be shorter (tip_off_deg_s)", "tip_off_deg_s"),
         "control.sample_s: must be shorter (tip_off_deg_s)",
         "control.sample_s: must be shorter (--tip-off-deg-s)"),
        (RequestError("", "orbit: must be given by {tle}"),
         "orbit: must be given by tle", "orbit: must be given by --tle"),
        (RequestError("model", "must be a model; received '{tle}'"),
         "model: must be a model; received '{tle}'", "--model: must be a model; received '{tle}'"),
    ],
)  # fmt: skip
def test_keys_are_options_on_the_command_line(error, python, command):
    assert str(error) == python
    assert error.spelled(option) == command


@pytest.mark.parametrize(
    ("kind", "keys", "message"),
    [
        (DetumbleRequest, {"runs": 1.5}, "runs: must be a whole number; received 1.5"),
        (DetumbleRequest, {"runs": True}, "runs: must be a whole number; received True"),
        (DetumbleRequest, {"gains": None}, "gains: must be a whole number; received None"),
        (DetumbleRequest, {"within_s": "1"}, "within_s: must be a number or None; received '1'"),
        (ThreeAxisRequest, {"inertia": (1.0, 2.0)},
         "inertia: must be 3 numbers or None; received (1.0, 2.0)"),
        (ThreeAxisRequest, {"inertia": "123"},
         "inertia: must be 3 numbers or None; received '123'"),
        (ThreeAxisRequest, {"reference": "sun"},
         "reference: must be one of orbital, inertial or None; received 'sun'"),
        (CoilRequest, {"dipole_a_m2": 1, "diameter_m": 1, "mass_kg": 1, "metal": "tin"},
         "metal: must be one of copper, aluminium; received 'tin'"),
        (FieldConeRequest, {"inclination_deg": 50, "model": "igrf14"},
         "model: must be a list or None; received 'igrf14'"),
        (FieldPointRequest, {"extrapolate": 1}, "extrapolate: must be True or False; received 1"),
        (FieldPointRequest, {"points": 1}, "points: must be a path or None; received 1"),
    ],
)  # fmt: skip
def test_values_of_another_kind_are_refused(kind, keys, message):
    with pytest.raises(RequestError) as error:
        kind(**keys)
    assert str(error.value) == message


def test_numbers_of_numpy_and_paths_as_text_are_taken():
    asked = ThreeAxisRequest(inertia=np.array([1.0, 2.0, 2.5]), revolutions=np.int64(3))
    assert asked.revolutions == 3
    assert FieldPointRequest(points="places.csv").points == Path("places.csv")
