"""Tables of docs/theory/three-axis.md: the numbers of the gallery's record."""

import json
from pathlib import Path

import pytest

from gallery.entries.mag_4_4 import ANY, INCLINATIONS, LIMITS, PARTS, REGULATOR, WEIGHTS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "theory/three-axis.md").read_text(encoding="utf-8")
RECORD = json.loads((DOCS / "gallery/results.json").read_text(encoding="utf-8"))
(ENTRY,) = [data for data in RECORD if data["id"] == "MAG-4.4"]
KEPT = {check["name"]: check["measured"] for check in ENTRY["checks"]}


def cells(beginning: str) -> list[str]:
    """Cells of the row that begins so."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(beginning)]
    return [cell.strip() for cell in line.strip("|").split("|")]


def shown(number: float) -> str:
    """To a tenth, as texts have it."""
    return f"{number:.1f}"


def tenths(texts, numbers) -> bool:
    """Whether texts are these numbers of the record, which has four digits, to a tenth."""
    pairs = zip(texts, numbers, strict=True)
    return all(float(a) == pytest.approx(b, abs=0.0501 + 5e-4 * b) for a, b in pairs)


@pytest.mark.parametrize(
    ("name", "row"),
    [
        *((name, f"| {name} |") for name in WEIGHTS if "inverse" not in name),
        (WEIGHTS[3], "| weighted by the inverse of the mean"),
        (REGULATOR, "| gains that follow the orbit"),
    ],
)
def test_least_errors_of_the_laws(name, row):
    wanted = [KEPT[f"{i:.0f} deg: {name}, least error"] for i in INCLINATIONS]
    assert tenths(cells(row)[1:], wanted)


@pytest.mark.parametrize(
    ("case", "row"),
    [
        (LIMITS[0], "| J = 1, 2, 1.5, inertial, 70 deg"),
        (LIMITS[1], "| | 0.2 A m^2"),
        (LIMITS[2], "| | 2 A m^2"),
        (LIMITS[3], "| the same, 30 deg"),
    ],
)
def test_what_limits_the_accuracy(case, row):
    inclination, dipole = case
    start = f"{inclination:.0f} deg: regulator of {dipole:g} A m^2 for 10 deg, "
    _, spent, *errors = cells(row)
    assert spent == f"{dipole:g} A m^2"
    assert tenths(errors, [KEPT[start + part] for part in PARTS])


def test_the_best_of_any_gains_and_those_that_settle_fastest():
    text = " ".join(PAGE.split())
    best = [shown(KEPT[f"{i:.0f} deg: {ANY}, least error"]) for i in INCLINATIONS]
    assert "the best leave {} deg at 70 deg and {} deg at 30 deg".format(*best) in text
    fastest = shown(KEPT["70 deg: error of the gains that settle fastest"])
    torque = shown(1e6 * KEPT["70 deg: greatest torque of their position part"])
    assert f"greatest torque is then {torque}e-6 N m" in text
    assert f"the error reaches {fastest} deg" in text
