"""Inertia of a box and of parts: integrals, invariants, one source of the tensor, mistakes."""

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from torquer.analysis.budget import budget_while_held
from torquer.compile import engine
from torquer.scenario.load import scenario_from_data
from torquer.scenario.toml_text import html_of_given
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.results.file import load, save
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.body import Body
from torquer.spacecraft.masses import AnyMass, mass_properties

MASS = TypeAdapter(AnyMass)
BOX = {"mass_kg": 4.0, "box_m": [0.1, 0.2, 0.3]}
PANELS = [
    {"kind": "box", "mass_kg": 4.0, "size_m": [0.1, 0.1, 0.3], "centre_m": [0.0, 0.0, 0.15]},
    {"kind": "plate", "mass_kg": 0.3, "size_m": [0.3, 0.2], "axis": [0, 0, 1], "edge": [1, 0, 0],
     "centre_m": [0.2, 0.05, 0.3]},
    {"kind": "cylinder", "mass_kg": 0.5, "axis": [0, 1, 1], "radius_m": 0.03, "length_m": 0.2},
    {"kind": "sphere", "mass_kg": 0.2, "radius_m": 0.05, "centre_m": [-0.1, 0.0, 0.1]},
    {"kind": "tensor", "mass_kg": 0.4, "inertia_kg_m2": [1e-3, 2e-3, 1.5e-3]},
]  # fmt: skip


def scenario(body, **keys):
    return scenario_from_data({
        "start": "2020-03-20T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 60.0},
        "spacecraft": {"body": body},
        "initial": {"rate_deg_s": [1.0, 2.0, 3.0]},
        "control": {"law": {"kind": "off"}, "sample_s": 1.0},
        "simulation": {"duration_s": 20.0, "record_s": 1.0},
    } | keys)  # fmt: skip


# ------------------------------------------------------------------ tensors


def points_in(part, count, rng):
    """Points spread evenly over a part, in body axes from its centre."""
    u = rng.uniform(-0.5, 0.5, (count, 3))
    if part.kind == "box":
        return u * part.size_m
    if part.kind == "sphere":
        v = 2.0 * part.radius_m * rng.uniform(-0.5, 0.5, (4 * count, 3))
        return v[np.linalg.norm(v, axis=1) < part.radius_m]
    if part.kind == "plate":
        edges = np.array([part.edge, np.cross(part.axis, part.edge)])
        return (u[:, :2] * part.size_m) @ edges
    across = np.linalg.svd(np.array([part.axis]))[2][1:]
    v = 2.0 * part.radius_m * rng.uniform(-0.5, 0.5, (4 * count, 2))
    v = v[np.linalg.norm(v, axis=1) < part.radius_m]
    along = part.length_m * rng.uniform(-0.5, 0.5, (len(v), 1))
    return v @ across + along * np.array(part.axis)


@pytest.mark.parametrize("given", PANELS[:4])
def test_own_tensors_are_sums_over_points(given):
    """J = sum m (r.r E - r r^T) over half a million points."""
    part, rng = MASS.validate_python(given), np.random.default_rng(5)
    r = points_in(part, 500_000, rng)
    squares = np.einsum("ni,nj->ij", r, r) / len(r)
    tensor = part.mass_kg * (np.trace(squares) * np.eye(3) - squares)
    assert np.abs(tensor - part.own_inertia()).max() < 5e-3 * np.abs(tensor).max()


def test_a_box_is_the_sum_of_its_halves():
    """Steiner's theorem, and the centre of mass, whatever the origin."""
    whole = Body(**BOX)
    halves = [{"kind": "box", "mass_kg": 2.0, "size_m": [0.1, 0.2, 0.15],
               "centre_m": [3.0, -2.0, 1.0 + side]} for side in (-0.075, 0.075)]  # fmt: skip
    made = Body(parts=halves)
    assert np.array(made.inertia) == pytest.approx(np.array(whole.inertia), rel=1e-12, abs=1e-15)
    assert made.centre_of_mass_m() == pytest.approx([3.0, -2.0, 1.0])
    assert made.total_mass_kg() == 4.0 == whole.total_mass_kg()
    # m/12 (b^2 + c^2)
    assert np.diag(whole.inertia) == pytest.approx([4 / 12 * 0.13, 4 / 12 * 0.1, 4 / 12 * 0.05])
    assert not whole.centre_of_mass_m().any()


def test_off_diagonal_elements_are_minus_the_products_of_inertia():
    """Two points at (1, 1, 0) and (-1, -1, 0): sum m x y = 2, and J_xy = -2."""
    points = [{"kind": "box", "mass_kg": 1.0, "size_m": [0, 0, 0], "centre_m": [s, s, 0.0]}
              for s in (1.0, -1.0)]  # fmt: skip
    found = mass_properties([MASS.validate_python(point) for point in points]).inertia
    assert found == pytest.approx(np.array([[2.0, -2.0, 0.0], [-2.0, 2.0, 0.0], [0.0, 0.0, 4.0]]))


def test_a_plate_and_a_cylinder_turn_with_their_axes():
    turn = Rotation.from_rotvec([0.4, -0.9, 1.3])
    for given in (PANELS[1], PANELS[2]):
        turned = dict(given)
        for key in {"axis", "edge"} & given.keys():
            turned[key] = turn.apply(given[key]).tolist()
        m = turn.as_matrix()
        one, other = (MASS.validate_python(each).own_inertia() for each in (given, turned))
        assert other == pytest.approx(m @ one @ m.T, rel=1e-12, abs=1e-18)


# ------------------------------------------------------------------ one source


def test_inertia_follows_what_it_is_made_of():
    """`replace` changes the box or the mass; what was given stays as given."""
    one = scenario(BOX)
    heavier = one.replace("spacecraft.body.mass_kg", 8.0)
    assert np.array(heavier.spacecraft.body.inertia) == pytest.approx(
        2.0 * np.array(one.spacecraft.body.inertia)
    )
    longer = one.replace("spacecraft.body.box_m", [0.1, 0.2, 0.6])
    assert longer.spacecraft.body.inertia[0][0] == pytest.approx(4 / 12 * (0.04 + 0.36))
    assert one.spacecraft.body.inertia_kg_m2 is None
    made = scenario({"parts": PANELS})
    moved = made.replace("spacecraft.body.parts[1].mass_kg", 0.6)
    assert moved.spacecraft.body.inertia[2][2] > made.spacecraft.body.inertia[2][2]
    again = type(made).model_validate(made.model_dump())
    assert again.spacecraft.body.inertia == made.spacecraft.body.inertia
    assert "box_m" in html_of_given(one) and "inertia" not in html_of_given(one)


def test_another_tensor_takes_the_place_of_a_box():
    for body in (Body(**BOX), Body(parts=PANELS), Body(inertia_kg_m2=[1, 2, 2])):
        changed = body.model_copy(update=body.keys_with_inertia(np.diag([3.0, 4.0, 5.0])))
        assert np.array_equal(changed.inertia, np.diag([3.0, 4.0, 5.0]))
        assert changed.total_mass_kg() == body.total_mass_kg()


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("body", (BOX, {"parts": PANELS}))
def test_a_stored_result_has_the_same_inertia(tmp_path, body):
    """And moves as the same body with its tensor given."""
    own = scenario(body)
    result = simulate(own)
    save(result, tmp_path / "run.nc")
    back = flown_scenario(load(tmp_path / "run.nc"))
    assert back == own and back.spacecraft.body.inertia == own.spacecraft.body.inertia
    plain = simulate(scenario({"inertia_kg_m2": own.spacecraft.body.inertia}))
    assert np.array_equal(result["omega_body"].values, plain["omega_body"].values)
    assert np.array_equal(result["momentum_inertial"].values, plain["momentum_inertial"].values)


def test_a_bench_weighs_the_parts():
    keys = {"orbit": {"kind": "bench", "latitude_deg": 55.0},
            "environment": {"field": {"kind": "helmholtz_coils"}},
            "disturbance": {"suspension": {"centre_of_mass_m": [1e-3, 0.0, 0.0]}}}  # fmt: skip
    budget = budget_while_held(scenario({"parts": PANELS}, **keys))
    weight = sum(part["mass_kg"] for part in PANELS) * 9.80665
    size = np.linalg.norm(budget.disturbance["suspension"], axis=1)
    assert 0.0 < size.max() <= 1e-3 * weight * (1.0 + 1e-9)


# ------------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("body", "message"),
    (
        ({}, "inertia_kg_m2: either it, or box_m with mass_kg, or parts must be given; received "
             "none of them"),
        (BOX | {"inertia_kg_m2": [1, 1, 1]}, "must be given; received inertia_kg_m2 and box_m"),
        (BOX | {"parts": PANELS}, "must be given; received box_m and parts"),
        ({"box_m": [1, 1, 1]}, "mass_kg: must be given with box_m, for the inertia"),
        ({"parts": PANELS, "mass_kg": 5.0}, "mass_kg: must be left out with parts, whose sum it "
                                            "is; received 5"),
        ({"parts": [{"kind": "box", "mass_kg": 1.0, "size_m": [0, 0, 1]}]},
         "parts: must be positive definite"),
        ({"parts": [PANELS[1] | {"edge": [1, 0, 1]}]}, "edge: must be at right angles to axis"),
        ({"box_m": [1, 1, 0], "mass_kg": 1.0}, "greater than 0"),
    ),
)  # fmt: skip
def test_mistakes_are_one_line(body, message):
    with pytest.raises(ValueError, match=message):
        Body(**body)
