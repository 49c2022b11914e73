"""Mistakes in requests: Python reads keys, the command line its options."""

import pytest

from torquer.base.limits import RequestError
from torquer.cli.options import option


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
