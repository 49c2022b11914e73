"""Files of wheel designs: every kind of layout, and one clear line for each mistake."""

from pathlib import Path

import numpy as np
import pytest

from torquer.base.explain import ScenarioError
from torquer.design.wheel_file import load_wheels, wheels_from_text
from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.presets import LAYOUTS

EXAMPLE = Path(__file__).parents[2] / "examples/wheels/foton.toml"
TEXT = EXAMPLE.read_text(encoding="utf-8")
PYRAMID = '{ kind = "four_sided_pyramid", alpha_deg = 80.5, beta_deg = 45.5 }'


@pytest.mark.parametrize(
    ("expected", "axes"),
    [
        (PYRAMID, layout.four_sided_pyramid(80.5, 45.5)),
        ('{ kind = "regular_pyramid", count = 5, gamma_deg = 50 }', layout.regular_pyramid(5, 50)),
        ('{ kind = "orthogonal" }', np.eye(3)),
        ('{ kind = "orthogonal_and_skew" }', layout.orthogonal_and_skew()),
        ('{ kind = "icosahedral" }', layout.icosahedral()),
        ('{ kind = "axes", axes = [[2, 0, 0], [0, 3, 0], [0, 0, 1]] }', np.eye(3)),
    ],
)
def test_every_kind_of_layout(expected, axes):
    design = wheels_from_text(TEXT.replace(PYRAMID, expected))
    assert np.array(design.wheels.array().axes) == pytest.approx(axes)
    assert any(f'"{kind}"' in expected for kind in LAYOUTS)


def test_array_takes_the_file_name_if_none_is_given(tmp_path):
    path = tmp_path / "my wheels.toml"
    path.write_text(TEXT.replace('name = "foton_wheels"', ""))
    assert load_wheels(path).name == "my_wheels"
    assert load_wheels(EXAMPLE).name == "foton_wheels"


KINDS = ", ".join(LAYOUTS)


@pytest.mark.parametrize(
    ("right", "wrong", "line"),
    [
        (PYRAMID, '{ kind = "cone" }', f"wheels.layout.kind: must be one of {KINDS}; "
         "received 'cone'"),
        (PYRAMID, "{ alpha_deg = 3 }", f"wheels.layout.kind: must be one of {KINDS}; "
         "received nothing"),
        (PYRAMID, '"pyramid"', "wheels.layout: must be a table of keys; received 'pyramid'"),
        ("alpha_deg = 80.5", "alpha_deg = 95", "wheels.layout.alpha_deg: must be less than 90; "
         "received 95"),
        (PYRAMID, '{ kind = "axes", axes = [[1, 0, 0], [0, 1, 0]] }',
         "wheels.layout.axes: must be 3 to 12; received 2"),
        (PYRAMID, '{ kind = "axes", axes = [[1, 0, 0], [0, 1, 0], [-1, 0, 0]] }',
         "wheels.layout.axes: must hold three that do not lie in one plane; "
         "received [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]"),
        ("momentum_limit_n_m_s = 18.0", "momentum_limit_n_m_s = [1, 2]",
         "wheels.momentum_limit_n_m_s: must be one number or one per wheel (4); received 2"),
        ("momentum_limit_n_m_s = 18.0", "momentum_limit_n_m_s = 1\nlost = [4]",
         "wheels.lost: must be different wheel numbers from 0 to 3; received (4,)"),
        ("momentum_limit_n_m_s = 18.0", "momentum_limit_n_m_s = 1\nlost = [0, 1, 2, 3]",
         "wheels.lost: must leave a wheel; received (0, 1, 2, 3)"),
        ("momentum_limit_n_m_s = 18.0", "momentum_limit_n_m_s = [1, 1, 1, 1e-9]",
         "wheels.momentum_limit_n_m_s: must be from 1e-12 to 1e+12 and within a factor of 1e+06 "
         "of one another; received [1.0, 1.0, 1.0, 1e-09]"),
        ("density_kg_m3 = 3.0e-12", "", "accumulation.density_kg_m3: must be above 0 with parts, "
         "and 0 without; received 0 with 2 parts"),
        ('kind = "cylinder"', 'kind = "cone"', "accumulation.parts[0].kind: must be one of "
         "box, cylinder, plate, sphere; received 'cone'"),
        ("altitude_km = 425", "altitude_km = 1e30",
         "accumulation.altitude_km: must be less than or equal to 1500000; received 1e+30"),
        ("\nrate_deg_s", "\nrate", "demand.rate: must be a known key; received 0.15 "
         "(did you mean rate_deg_s?)"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_clear_line(right, wrong, line):
    assert right in TEXT
    with pytest.raises(ScenarioError) as found:
        wheels_from_text(TEXT.replace(right, wrong, 1))
    assert str(found.value) == line


def test_unreadable_files_and_broken_toml(tmp_path):
    with pytest.raises(ScenarioError, match=r"design: must be a readable file; received .*missing"):
        load_wheels(tmp_path / "missing.toml")
    with pytest.raises(ScenarioError, match="design: must be TOML; received"):
        wheels_from_text("name = [")
