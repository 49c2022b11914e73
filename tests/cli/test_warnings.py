"""Which of Python's warnings a command shows: this package's own, and those on the user's code."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.campaign.fly import OneByOne
from torquer.cli.output import let_streams_take_any_text
from torquer.compile.code_cache import CacheNote
from torquer.environment.field.coefficients import Extrapolated, check_date
from torquer.simulation.results.restore import OtherBits
from torquer.simulation.setup.checkpoints import NotSaved
from torquer.theory.three_axis.periodic_lqr import _close

INSIDE = Path(torquer.__file__).parent / "theory" / "gains.py"
PITCH = """
start = 2025-06-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 51.6 }
spacecraft.body.inertia_kg_m2 = [0.05, 0.055, 0.02]
spacecraft.coils.limit_a_m2 = 0.2
[initial]
reference = "orbital"
rate_deg_s = [0, 0, 0]
rate_relative_to = "orbital"
[control]
sample_s = 2.0
[control.law]
kind = "three_axis"
reference = "orbital"
euler_deg = [0, 30, 0]
rate_gain_n_m_s_per_t2 = 1e5
angle_gain_n_m_per_t2 = 100.0
[simulation]
revolutions = 12
record_s = 30.0
"""


@pytest.fixture
def say(capsys, monkeypatch):
    """`say(category, file)`: what a command shows of a warning that is given in a file."""
    monkeypatch.setattr(sys, "warnoptions", [])

    def said(category, file):
        with warnings.catch_warnings():
            let_streams_take_any_text()
            warnings.simplefilter("always")
            warnings.warn_explicit("overflow encountered in matmul", category, str(file), 7)
        return capsys.readouterr().err

    return said


@pytest.mark.parametrize("category", [RuntimeWarning, DeprecationWarning, UserWarning])
@pytest.mark.parametrize(
    "file", [INSIDE, np.__file__, subprocess.__file__, "<string>", "<frozen importlib>"]
)
def test_what_libraries_say_is_no_note(say, category, file):
    assert say(category, file) == ""


@pytest.mark.parametrize("category", [OneByOne, CacheNote, Extrapolated, OtherBits, NotSaved])
def test_what_this_package_says_is_a_note(say, category):
    assert say(category, INSIDE) == "note: overflow encountered in matmul\n"


def test_what_is_said_of_the_users_code_names_its_line(say, tmp_path):
    expected = "warning: law.py:7: overflow encountered in matmul\n"
    assert say(RuntimeWarning, tmp_path / "law.py") == expected


def test_a_field_model_beyond_its_dates_is_a_note(capsys, monkeypatch):
    monkeypatch.setattr(sys, "warnoptions", [])
    with warnings.catch_warnings():
        let_streams_take_any_text()
        warnings.simplefilter("always")
        check_date("igrf14", 2031.5, extrapolate=True)
    assert capsys.readouterr().err == (
        "note: field model igrf14: date must lie within 1900.0..2030.0; received 2031.5: "
        "extrapolated\n"
    )


def test_warnings_that_python_is_asked_for_are_shown_as_it_writes_them():
    text = "import warnings; from torquer.cli import output as o; o.let_streams_take_any_text();"
    warn = f"warnings.warn_explicit('overflow', RuntimeWarning, {str(INSIDE)!r}, 7)"
    ask = [sys.executable, "-W", "always", "-c", f"{text} {warn}"]
    said = subprocess.run(ask, capture_output=True, text=True, check=True).stderr
    assert "gains.py:7: RuntimeWarning: overflow" in said


def test_a_regulator_with_too_few_steps_says_nothing():
    """Of numbers that overflow: the search goes on with shorter steps."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        closed = _close(np.full((400, 12, 12), 1e3), np.ones((401, 6, 6)))
    assert not np.isfinite(closed).all()


@pytest.mark.slow
def test_a_design_for_a_pitched_attitude_speaks_of_its_laws_alone(call, tmp_path):
    (tmp_path / "pitch.toml").write_text(PITCH)
    code, out, err = call("design", "three-axis", tmp_path / "pitch.toml")
    notes = [line for line in out.splitlines() if line.startswith("note: ")]
    assert (code, err) == (0, "") and notes
    assert all(n.split()[1] in ("formula:", "refined:", "regulator:", "own:") for n in notes)
