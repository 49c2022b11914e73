"""A swept angle: each point is the array of that angle, and the peak is one of them."""

from pathlib import Path

import numpy as np
import pytest

from torquer.design.wheel_design import analyse
from torquer.design.wheel_file import load_wheels, wheels_from_text
from torquer.design.wheel_sweep import sweep_angle

FOTON = Path(__file__).parents[2] / "examples/wheels/foton.toml"
CUBE = """
[wheels]
momentum_limit_n_m_s = 0.01
layout = { kind = "regular_pyramid", count = 4, gamma_deg = 50.0 }

[body]
inertia_kg_m2 = [0.02, 0.02, 0.02]
"""


def test_sweep_point_equals_the_report_on_that_angles_array():
    design = load_wheels(FOTON)
    swept = sweep_angle(design, "alpha_deg", np.linspace(60.5, 80.5, 2).tolist())
    report, point = analyse(design), swept.points[-1]
    assert point.value == 80.5
    assert point.volume_n3_m3_s3 == report["momentum"]["volume_n3_m3_s3"]
    assert point.whole.rate_deg_s == report["momentum"]["worst_rate_deg_s"]
    assert point.whole.momentum_n_m_s == report["momentum"]["worst_direction_n_m_s"]
    singles = [case for case in report["failures"] if len(case["lost"]) == 1]
    assert point.one_failed.rate_deg_s == min(case["worst_rate_deg_s"] for case in singles)
    assert point.demand_share == max(each["share"] for each in report["demand"].values())
    assert point.saturation_h == report["accumulation"]["saturation_minimax_h"]


def test_the_peak_is_the_angle_of_balanced_rates():
    """WHEEL section 4: what `angles.balanced_four_sided` gives in closed form, with beta given."""
    swept = sweep_angle(load_wheels(FOTON), "alpha_deg", np.linspace(60, 88, 8).tolist())
    best = swept.best()
    others = [point.whole.rate_deg_s for point in swept.points if point is not best]
    assert best.value == pytest.approx(80.509, abs=2e-3) and best.whole.rate_deg_s > max(others)
    values = [point.value for point in swept.points]
    assert values == sorted(values) and len(values) == 9


def test_for_equal_moments_the_peak_is_that_of_the_cube():
    """The envelope is then that of a rhombic dodecahedron at tan(gamma)^2 = 2."""
    best = sweep_angle(wheels_from_text(CUBE), "gamma_deg", np.linspace(20, 80, 7).tolist()).best()
    assert best.value == pytest.approx(np.degrees(np.arctan(np.sqrt(2.0))), abs=1e-3)
    assert best.demand_share is None and best.saturation_h is None


def test_a_lost_wheel_stays_lost():
    text = CUBE.replace("layout", "lost = [2]\nlayout")
    point = sweep_angle(
        wheels_from_text(text), "gamma_deg", np.linspace(40, 60, 3).tolist()
    ).points[0]
    assert point.whole.rate_deg_s > 0.0 and point.one_failed.rate_deg_s == 0.0
