"""Pages on satellites from their data sheets: classes, what is assumed, and the dozen flown."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from torquer.design.left_out import sheet_rules, size_classes
from torquer.theory.averaged.conditions import FLOWN

ROOT = Path(__file__).parents[1]
FLOWN_FILE = ROOT / "benchmarks/satellites.json"
WHEELS_FILE = ROOT / "benchmarks/satellites_with_wheels.json"
TEXTS = tomllib.loads((Path(__file__).parent / "satellites_page.toml").read_text(encoding="utf-8"))
#: A cause limits where its absence halves the median error.
_HALF = 0.5


def page(language: str) -> str:
    """The page in a language, "en" or "ru"."""
    words = TEXTS[language]
    tables = {
        "{rules}": _rules(words),
        "{classes}": _classes(words),
        "{stops}": _stops(words),
        "{holds}": _holds(words),
        "{wheels}": _wheels(words),
    }
    text = words["page"]
    for mark, table in tables.items():
        text = text.replace(mark, table)
    return text


def _sourced(head: list[str], rows: list[list[str]]) -> str:
    """A table whose last column has sources, as they stand in the data; left out of a shorter
    head."""
    return _table(head, [row[: len(head)] for row in rows])


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _rules(words: dict) -> str:
    """What a data sheet leaves open: values, spreads, keys, sources."""
    rules = sheet_rules()
    low, high = rules["inertia"]["edges"]
    dipole = ", ".join(f"{1e3 * each:g}" for each in rules["dipole"]["per_kg"])
    least, usual, most = rules["surface"]["f107"]
    rows = [
        [words["inertia"], words["box"], f"{low:g}..{high:g}", "`spacecraft.body.box_m`",
         rules["inertia"]["source"]],
        [words["dipole"], f"{dipole} mA m^2/kg", words["log"],
         "`spacecraft.coils.residual_dipole_a_m2`", rules["dipole"]["source"]],
        [words["air"], f"{rules['surface']['drag_coefficient']:g}; F10.7 {usual}",
         f"F10.7 {least}..{most}", "`environment.atmosphere.f107`", rules["surface"]["source"]],
        [words["centre"], words["middle"], words["sigma"],
         "`spacecraft.aerodynamics.parts[k].centre_m`", words["by_class"]],
        [words["panels"], f"{rules['panel']['mass_per_area']:g} kg/m^2", "-", "`box_m`",
         rules["panel"]["source"]],
    ]  # fmt: skip
    return _sourced(words["rules_head"], rows)


def _classes(words: dict) -> str:
    rows = [
        [f"`{name}`", " x ".join(f"{edge:g}" for edge in each.size_m), f"{each.mass_kg:g}",
         f"{each.limit_a_m2:g}", ", ".join(f"{c:g}" for c in each.centre_m),
         f"{each.tip_off_deg_s:g}", each.source]
        for name, each in size_classes().items()
    ]  # fmt: skip
    return _sourced(words["classes_head"], rows)


def flown() -> dict:
    """What `benchmarks/satellites.py` measured, in the order of masses."""
    found = json.loads(FLOWN_FILE.read_text(encoding="utf-8"))
    return dict(sorted(found.items(), key=lambda item: (item[1]["mass_kg"], item[0])))


def _stops(words: dict) -> str:
    """Gain, time promised and flown, verdict."""
    rows = []
    for name, each in flown().items():
        stop, clean = each["stop"], each["stop_without_dipole"]
        ratio = stop["flown_s"] / stop["promised_s"]
        verdict = words["confirmed"] if FLOWN.holds(ratio) else words["doubtful"]
        rows.append([
            f"[`{name}`](../examples/satellites/{name}.toml)", f"{each['mass_kg']:g}",
            f"{1e3 * each['dipole_a_m2']:.3g}", _gain(stop["gain_a_m2_s_per_t"]),
            *(_hours(stop[key]) for key in ("promised_s", "flown_s", "flown_90_s")),
            f"{ratio:.2f}", _hours(clean["flown_s"]), verdict,
        ])  # fmt: skip
    return _table(words["stops_head"], rows)


def _wheels(words: dict) -> str:
    """A slew and what is held after it by wheels; the pointing budget."""
    rows = [
        [f"[`{name}`](../examples/satellites/{name}.toml)",
         f"{each['momentum_n_m_s']:g} N m s, {each['torque_n_m']:g} N m",
         f"{each['below_deg']:g}", f"{each['held_after_s']:.0f}", f"{each['commanded_deg']:.2g}",
         f"{100.0 * each['momentum_share']:.2g} %",
         f"{each['predicted_deg']:.2g}", f"{each['flown_deg']:.2g}"]
        for name, each in json.loads(WHEELS_FILE.read_text(encoding="utf-8")).items()
    ]  # fmt: skip
    return _table(words["wheels_head"], rows)


def _holds(words: dict) -> str:
    """Errors of a hold by coils, with and without causes, and what limits."""
    rows = []
    for name, each in flown().items():
        if "hold" not in each:
            rows.append([f"`{name}`", *["-"] * (len(words["holds_head"]) - 1)])
            continue
        cases = each["hold"]["without"]
        rows.append([f"`{name}`", *map(_held, cases.values()), words[limit(cases)]])
    return _table(words["holds_head"], rows)


def limit(cases: dict) -> str:
    """The cause whose absence leaves the least median error, if that is half of it or less."""
    all_deg = cases["nothing"]["median_deg"]
    single = min(("dipole", "air_and_light"), key=lambda name: cases[name]["median_deg"])
    for name in (single, "both"):
        if cases[name]["median_deg"] <= _HALF * all_deg:
            return name
    return "neither"


def _held(case: dict) -> str:
    median = case["median_deg"]
    shown = "< 0.01" if median < 0.01 else f"{median:.0f}" if median >= 10 else f"{median:.2g}"
    return f"{shown} ({case['held']})"


def _gain(gain: float) -> str:
    return f"{gain:.3g}".replace("e+0", "e")


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f}"
