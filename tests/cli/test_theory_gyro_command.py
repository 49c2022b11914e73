"""`torquer theory magneto-gyro`: rows of text and law, a scenario's numbers, pictures, mistakes."""

import json
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.scenario.load import load_scenario
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.models import gyro_models
from torquer.theory.magneto_gyro.requests import GyroModelsRequest
from torquer.theory.magneto_gyro.satellite import make_craft, noise_intensity

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "magneto_gyro.toml"


@pytest.fixture
def models(call):
    """`models(...)`: exit code, output, errors."""
    pytest.importorskip("sympy")
    return lambda *arguments: call("theory", "magneto-gyro", *arguments)


@pytest.mark.slow
def test_rows_of_text_and_law_are_printed_side_by_side(models):
    code, out, _ = models()
    assert code == 0
    assert out.count("  text  ") == out.count("  law   ") == 9 + 12
    assert out.count("        the same") == 9 + 12 and "DIFFERS" not in out
    assert "[1] text: k = K/(J nu0^2); must be: k = K/[(1 + b^2) J nu0^2]" in out
    assert "R9 = -2 xi omega^3 d_t" in out
    assert "along pitch, a constant torque: Y3 = 0, Y4 = 0, Z3 = 1; all else 0" in out
    assert "transfer function to theta has zeros at +-i" in out


def test_the_numbers_of_a_scenario_are_those_of_its_law(models):
    data = json.loads(models(EXAMPLE, "--order", "15", "--json")[1])["15"]["numbers"]
    law = load_scenario(EXAMPLE).control.law
    gains = *law.angle_gains, *law.rate_gains, *law.estimator_gains, *law.compensator_gains
    matrix = frozen_2(
        Stage2Gains(*gains), stiffness=data["stiffness"], pitch_inertia=data["pitch_inertia"],
        b=data["normal"],
    )  # fmt: skip
    assert data["polynomial"] == pytest.approx(np.poly(matrix).real.tolist())
    assert data["frozen_degree"] == pytest.approx(-np.linalg.eigvals(matrix).real.max())
    assert data["degree"] == pytest.approx(0.25, abs=0.02)
    assert max(real for real, _ in data["roots"]) == pytest.approx(-data["frozen_degree"])


def test_python_gets_the_models_that_the_command_prints(models):
    found = gyro_models(load_scenario(EXAMPLE), GyroModelsRequest(order=15))
    assert found.data() == json.loads(models(EXAMPLE, "--order", "15", "--json")[1])
    assert found.lines() == models(EXAMPLE, "--order", "15")[1].splitlines()
    table = found._repr_html_()
    assert "<td>stage 2, order 15</td>" in table and "exact [nu0]" in table


@pytest.mark.parametrize(
    ("name", "noise_nt", "interval_s"),
    [("magneto_gyro", 50.0, 1.0), ("magneto_gyro_micro", 150.0, 2.5)],
)
def test_noise_counts_once_a_control_step(name, noise_nt, interval_s):
    """Two in five seconds where the coils are off for one: at its beginning and at its end."""
    scenario = load_scenario(Path(EXAMPLE).with_stem(name))
    craft, _ = make_craft(scenario)
    found = noise_intensity(scenario, craft, strength_t=3e-5)
    wanted = (noise_nt / 30_000.0) ** 2 * craft.orbital_rate_rad_s * interval_s
    assert found == pytest.approx(wanted)


@pytest.mark.slow
def test_the_pictures_are_drawn(models, tmp_path, monkeypatch):
    from torquer.report.theory import magneto_gyro_models as drawing

    monkeypatch.setattr(drawing, "_GRID", 7)
    monkeypatch.setattr(drawing, "_STIFFNESS", np.linspace(-1.0, 10.0, 12))
    code, out, _ = models(EXAMPLE, "--out", tmp_path)
    assert code == 0
    names = ["stage_1_gains", "stage_1_h", "stage_1_roots", "stage_2_h", "stage_2_roots",
             "stage_2_dipole", "stage_2_noise"]  # fmt: skip
    assert [Path(line).stem for line in out.splitlines()[-7:]] == names
    for name in names:
        assert matplotlib.image.imread(tmp_path / f"{name}.png").std() > 0.05


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--out", "folder"), "--out: must be given with SCENARIO, whose numbers are drawn"),
        ((EXAMPLES / "safe_mode.toml",), "control.law: must be magneto_gyro; received "),
        (("--order", "13"), "--order"),
    ],
)
def test_mistakes_are_one_line(models, arguments, message):
    code, out, error = models(*arguments)
    assert code == 2 and out == "" and message in error
    assert len(error.strip().splitlines()) == 1


def test_without_sympy_it_says_what_to_install(models, monkeypatch):
    monkeypatch.delattr("torquer.theory.magneto_gyro.model_rows", raising=False)
    monkeypatch.setitem(sys.modules, "torquer.theory.magneto_gyro.model_rows", None)
    code, _, error = models()
    assert code == 2 and "magneto-gyro: needs sympy: pip install 'torquer[symbolic]'" in error
