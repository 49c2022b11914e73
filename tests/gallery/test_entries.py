"""Every entry reaches the verdict that it declares; the committed pages are those of its data."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from gallery.entry import Outcome
from gallery.lookup import all_entries
from gallery.pages import PICTURES, RECORD, pages, record_of
from torquer.compile import engine
from torquer.environment.orbit import Circular

DOCS = Path(__file__).parents[2] / "docs/gallery"
ENTRIES = {entry.id: entry for entry in all_entries()}
KEPT = {data["id"]: data for data in json.loads((DOCS / RECORD).read_text(encoding="utf-8"))}
#: One unit in the fourth digit of the least number of four digits: what the record keeps.
FOURTH_DIGIT = 1e-3
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")


PARAMETERS = [
    pytest.param(entry, id=id_, marks=[pytest.mark.slow] if entry.slow else [])
    for id_, entry in ENTRIES.items()
]


@needs_jit
@pytest.mark.parametrize("entry", PARAMETERS)
def test_entry_reaches_its_declared_verdict_and_the_recorded_numbers(entry):
    answer = entry.compute()
    assert answer.figures
    assert answer.verdict is entry.declared, [(c.name, c.verdict) for c in answer.checks]
    (made,) = record_of([Outcome(entry, answer)])
    for now, kept in zip(made["checks"], KEPT[entry.id]["checks"], strict=True):
        number, before = now.pop("measured"), kept["measured"]
        away = now.pop("uncertainty") + kept["uncertainty"] + 1e-9
        assert number == (before and pytest.approx(before, rel=FOURTH_DIGIT, abs=away))
        assert now.items() <= kept.items(), "run make gallery"


def test_the_record_has_what_the_entries_declare():
    declared = {
        entry.id: {
            "ids": list(entry.ids),
            "verdict": str(entry.declared),
            "declared": str(entry.declared),
            "reason": entry.reason,
            "title": "; ".join(row.content for row in entry.rows),
            "expected": "; ".join(row.expected for row in entry.rows if row.expected),
        }
        for entry in ENTRIES.values()
    }
    assert {name: {key: KEPT[name][key] for key in each} for name, each in declared.items()} == (
        declared
    )


def test_the_record_has_every_entry_and_no_other():
    assert list(KEPT) == list(ENTRIES)


@pytest.mark.parametrize("name", sorted(pages([])))
def test_page_is_up_to_date(name):
    assert (DOCS / name).read_text(encoding="utf-8") == pages(list(KEPT.values()))[name], (
        "run make gallery"
    )


def test_small_pictures_are_there_and_small():
    shown = {name for data in KEPT.values() for name in data["pictures"]}
    assert shown == {path.name for path in (DOCS / PICTURES).iterdir()}
    for path in (DOCS / PICTURES).iterdir():
        assert path.read_bytes().startswith(b"\x89PNG")
        assert 3000 < path.stat().st_size < 60_000, path.name


def test_field_axes_are_turned_into_ours():
    """FIELD's orbital axes up, motion, normal: a body on them has axis 1 up, axis 3 normal."""
    from scipy.spatial.transform import Rotation

    from gallery.four_models import attitude

    to_x = Rotation.from_quat(attitude((0.0, 0.0, 0.0))).as_matrix()
    assert to_x.round(12).tolist() == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    # the first turn, of 60 deg about the vertical, leaves axis 1 up and tilts axis 3
    tilted = Rotation.from_quat(attitude((60.0, 0.0, 0.0))).as_matrix()
    assert tilted[:, 0] == pytest.approx([0.0, 0.0, 1.0])
    assert tilted[1, 2] == pytest.approx(0.5)


def test_gain_of_mag_5_1_makes_small_parameter_one():
    from gallery.entries import mag_5_1 as run

    assert run.GAIN * run.B0_T**2 / (run.INERTIA[2] * run.OMEGA0) == pytest.approx(1.0, abs=1e-4)
    assert run.GAIN == 4.5362e6  # as 4.5362e3 the text has it
    rates = [Circular(radius_km=r, inclination_deg=0.0).rate_rad_s() for r in (6730.0, 7359.0)]
    assert rates == pytest.approx([0.00114, 0.001], abs=5e-6)
    orbit = run.scenario("averaged").orbit
    assert orbit.rate_rad_s() == pytest.approx(run.OMEGA0, rel=1e-12)


def test_the_share_of_the_field_in_the_printed_cost():
    from gallery.entries.field_cost import PRINTED_FIELD_S, PRINTED_S

    assert PRINTED_FIELD_S / PRINTED_S["IGRF-14"] == pytest.approx(0.87, abs=5e-3)


def test_where_the_momentum_of_mag_3_6_starts():
    """34 to 73 deg from a target 19.6 deg off axis 3, whatever its azimuth."""
    from gallery.entries.mag_3_5_3 import DIAGONAL
    from gallery.spinning import aside

    momentum = np.array(DIAGONAL) / np.linalg.norm(DIAGONAL)  # 6 deg/s about each axis
    targets = np.array([aside(19.6, azimuth) for azimuth in range(360)])
    angles = np.degrees(np.arccos(targets @ momentum))
    assert [angles.min(), angles.max()] == pytest.approx([34.0, 73.0], abs=0.5)


def test_the_guide_for_new_entries_runs(tmp_path):
    """The example of CONTRIBUTING.md is an entry."""
    text = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = text.split("## Add a gallery entry")[1].split("```python\n")[1].split("```")[0]
    path = tmp_path / "example.py"
    path.write_text(code, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("example", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    answer = module.ENTRY.compute()
    assert answer.verdict is module.ENTRY.declared and answer.figures
