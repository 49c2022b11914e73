"""Make docs/scenario.md, equations.md, api.md and others from the code: `python docs/generate.py`.

Also the tables from which `torquer explain` answers.
"""

import ast
import functools
import importlib
import itertools
import json
import re
import sys
import tomllib
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parents[1]))  # the gallery is no part of what is installed

import numpy as np
from flight_functions import functions_page
from flight_requirements import requirements_page
from satellites_page import page as page_of_satellites

import gallery.theory
import torquer.design
import torquer.theory
from torquer.cli.app import app
from torquer.cli.examples import EXAMPLES
from torquer.design import stored_keys
from torquer.design.file_keys import design_tables, file_tables, stored_tables
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.document import document
from torquer.ground.telemetry.reading.described import format_rows, mapping_tables, quantity_rows
from torquer.ground.telemetry.reading.epochs import TICKS
from torquer.scenario.described import Key, Table
from torquer.scenario.load import presets
from torquer.scenario.spec import Spacecraft
from torquer.scenario.words import trade_words
from torquer.simulation.results.variables import ATTRIBUTES, COORDINATES, LOGS, VARIABLES, Variable
from torquer.theory.where_it_holds import table as conditions_table

ROOT = Path(__file__).parents[1]
_ONE = r"[A-Z]+\s*\(\d+(?:\.\d+)+\)"
#: `Source: MAG (2.1.3).` or `Source: FIELD (1.10), FIELD (1.11)`, line breaks allowed.
SOURCE = re.compile(rf"Source:\s+({_ONE}(?:,\s+(?:and\s+)?{_ONE})*)")
_CITED = re.compile(r"([A-Z]+)\s*\((\d+(?:\.\d+)+)\)")


def scenario_page() -> str:
    """Reference of scenario files: one section a table, one row a key."""
    head = [
        "# Scenario files, key by key",
        "",
        "Made from the code by `docs/generate.py`. A scenario is a TOML file; units are in the",
        'keys. In a hardware table, `preset = "name"` takes the keys of a shipped preset',
        "(" + "; ".join(_presets_listed()) + "); keys given beside it take precedence.",
        "",
        "`torquer explain KEY` prints the same; `torquer schema` prints a JSON schema, with which",
        "an editor completes and describes keys. Names of your choice are NAME below, elements of",
        "lists `[]`. [What MAG, SDOT and FIELD are](sources.md).",
        "",
    ]
    return "\n".join(head + [line for table in file_tables() for line in _table(table)])


def wheels_page() -> str:
    """Reference of wheel design files, likewise."""
    head = [
        "# Wheel design files, key by key",
        "",
        "Made from the code by `docs/generate.py`. `torquer wheels FILE` reads a wheel design, a",
        "TOML file with these tables, or the wheels and body of a scenario. `torquer explain KEY`",
        "knows these keys, too.",
        "",
    ]
    return "\n".join(head + [line for table in design_tables() for line in _table(table)])


def _presets_listed() -> list[str]:
    """Each table of hardware that has presets, with their names."""
    fitting = {table: presets(table) for table in Spacecraft.model_fields}
    return [f"`{table}`: {', '.join(names)}" for table, names in fitting.items() if names]


def _table(table: Table) -> list[str]:
    """A section: where the table stands, what it is, its keys."""
    also = [f"Also at {', '.join(f'`{p}`' for p in table.places[1:])}.", ""]
    rows = [" | ".join(_row(key)) for key in table.keys]
    return [
        f"## {table.title}", "", table.about, "", *(also if table.places[1:] else []),
        "| key | what it is | unit | values | default |", "|---|---|---|---|---|",
        *(f"| {row} |" for row in rows), "",
    ]  # fmt: skip


def _row(key: Key) -> list[str]:
    cells = [key.description, key.unit, key.values]
    default = f"`{key.default}`" if key.default else "**must be given**"
    return [f"`{key.name}`", *(cell.replace("|", "\\|") for cell in cells), default]


def citations_of(docstring: str) -> list[tuple[str, str]]:
    """(key, number) of all formulas that a docstring is the home of."""
    return [c for found in SOURCE.findall(docstring) for c in _CITED.findall(found)]


def docstrings_of(source: str):
    """(name, docstring) of a module and all that is in it."""
    described = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, described) and (text := ast.get_docstring(node)):
            yield getattr(node, "name", "module"), text


@functools.cache
def all_docstrings() -> list[tuple[str, str]]:
    """(place, docstring) of everything in the package and in the gallery's theory."""
    return [
        (f"{path.relative_to(ROOT).as_posix()}: `{name}`", text)
        for folder in ("torquer", "gallery/theory")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for name, text in docstrings_of(path.read_text(encoding="utf-8"))
    ]


@functools.cache
def sources() -> list[tuple[str, str, str]]:
    """(key, number, place) of every published formula that has its home here."""
    return [(*c, place) for place, text in all_docstrings() for c in citations_of(text)]


def equations_page() -> str:
    """Index of published formulas and their one home in the code."""
    order = sorted(sources(), key=lambda s: (s[0], [int(n) for n in s[1].split(".")]))
    head = ["# Index of published formulas", "", "Made from the code by `docs/generate.py`. "
            "[What the keys stand for](sources.md).", ""]  # fmt: skip
    tables = itertools.groupby(order, key=lambda source: source[0])
    return "\n".join(head + [line for key, rows in tables for line in _formulas_table(key, rows)])


def _formulas_table(key: str, rows) -> list[str]:
    """Formulas of one source."""
    lines = [f"| {key} ({number}) | {place} |" for _, number, place in rows]
    return [f"## {key}", "", "| formula | home |", "|---|---|", *lines, ""]


#: Packages with public names, and modules whose functions are all public.
PACKAGES = (
    "torquer",
    "torquer.environment.earth.atmosphere",
    "torquer.environment",
    "torquer.environment.field",
    "torquer.environment.orbit",
    "torquer.analysis.field",
    "torquer.ground",
    "torquer.ground.telemetry",
    "torquer.flight.software",
    "torquer.theory",
    "torquer.design",
    "torquer.spacecraft.wheel_array",
)
MODULES = (
    "torquer.analysis.derived",
    "torquer.maths.geometry.frames",
    "torquer.maths.geometry.euler",
    "torquer.maths.geometry.quaternion",
    "torquer.maths.geometry.vec3",
    "torquer.environment.field.averaged",
    "torquer.environment.field.direct_dipole",
    "torquer.theory.slow.evolution.bdot",
    "torquer.theory.slow.evolution.nutation_damping",
    "torquer.theory.slow.evolution.spin_up",
    "torquer.theory.slow.evolution.reorientation",
    "torquer.theory.slow.evolution.sdot",
    "torquer.theory.slow.evolution.preliminary_1",
    "torquer.theory.slow.evolution.preliminary_2",
)


def api_page() -> str:
    """Public names of the package and its documented parts, one line each."""
    head = ["# Public names", "", "Made from the code by `docs/generate.py`. "
            "[What MAG, SDOT, FIELD, WHEEL and MGS are](sources.md).", ""]  # fmt: skip
    tables = [*((p, public_names(p)) for p in PACKAGES), *((m, functions_of(m)) for m in MODULES)]
    return "\n".join(head + [line for each in tables for line in _names_table(*each)])


def public_names(package: str) -> list[str]:
    """Public names of a package, by the module that defines them."""
    names = (name for name in importlib.import_module(package).__all__ if name != "__version__")
    return sorted(names, key=lambda name: (home_of(package, name), name))


def _names_table(place: str, names) -> list[str]:
    about = (ast.get_docstring(tree_of(place)) or "").split("\n")[0]
    rows = [[f"`{n}`", line_of(place, n), f"`{home_of(place, n)}`"] for n in names]
    table = [["name", "what it is", "home"], ["---"] * 3, *rows]
    columns = 2 if place in MODULES else 3
    lines = ["| " + " | ".join(row[:columns]) + " |" for row in table]
    return [f"## {place}", "", about, "", *lines, ""]


def _source(place: str) -> str:
    path = ROOT.joinpath(*place.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return file.read_text(encoding="utf-8")


@functools.cache
def tree_of(place: str) -> ast.Module:
    """A module's source as Python reads it."""
    return ast.parse(_source(place))


def functions_of(place: str) -> list[str]:
    nodes = tree_of(place).body
    names = (node.name for node in nodes if isinstance(node, ast.FunctionDef))
    return [name for name in names if not name.startswith("_")]


def home_of(place: str, name: str) -> str:
    """The module in which a name that a package offers is defined."""
    imported = _imports(place).get(name)
    return home_of(imported, name) if imported else place


@functools.cache
def _imports(place: str) -> dict[str, str]:
    """Names that a module imports from others, and these."""
    found = (node for node in ast.walk(tree_of(place)) if isinstance(node, ast.ImportFrom))
    return {alias.name: node.module or "" for node in found for alias in node.names}


def line_of(place: str, name: str) -> str:
    """First line of what the source says of a name, "" if it says nothing."""
    source, tree = _source(home_of(place, name)), tree_of(home_of(place, name))
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return (ast.get_docstring(node) or "").split("\n")[0].replace("|", "\\|")
        named = getattr(node, "targets", [getattr(node, "target", None)])
        if name in (getattr(target, "id", "") for target in named):
            return _comment_above(source, node.lineno)
    return ""


def _comment_above(source: str, line: int) -> str:
    """First sentence of the `#:` comment above a line."""
    above = itertools.takewhile(
        lambda text: text.startswith("#:"), reversed(source.split("\n")[: line - 1])
    )
    text = " ".join(part.removeprefix("#:").strip() for part in reversed(list(above)))
    return text.split(". ")[0]


def variables_page() -> str:
    """The variables and attributes of a result."""
    head = [
        "# Variables of a result",
        "",
        "Made from the code by `docs/generate.py`. `torquer.simulate` and `torquer.load` give an",
        "`xarray.Dataset` with these variables; `result.nc` has the same. SI units throughout;",
        "`result.torquer.derived()` gives derived quantities, in degrees and rpm. J is",
        "the inertial frame J2000; body axes are those of the scenario's inertia tensor.",
        "",
        "The control step at the very end of a run is not executed: there, readings and commands",
        "are those of the step before.",
        "",
    ]
    variables = sorted(VARIABLES, key=lambda each: each.when)
    tables = (("Coordinates", COORDINATES), ("Variables", variables))
    parts = [line for title, rows in tables for line in _variables_table(title, rows)]
    attributes = [f"| `{name}` | {meaning} |" for name, meaning in ATTRIBUTES.items()]
    last = ["## Attributes", "", "| name | meaning |", "|---|---|", *attributes, ""]
    return "\n".join([*head, *parts, "## Logs", "", LOGS, "", *last])


def _variables_table(title: str, rows) -> list[str]:
    columns = "| name | dimensions | unit | frame | meaning |"
    return [f"## {title}", "", columns, "|---|---|---|---|---|", *map(_variable_row, rows), ""]


def _variable_row(v: Variable) -> str:
    meaning = f"{v.meaning} ({v.when})" if v.when else v.meaning
    return f"| `{v.name}` | {', '.join(v.dims) or 'none'} | {v.units} | {v.frame} | {meaning} |"


def packets_page() -> str:
    """Frames and packets of Chibis-M."""
    head = [
        "# Packets of Chibis-M",
        "",
        "Made by `docs/generate.py` from `torquer/flight/packets/chibis_m.toml`.",
        "Headers and beacon are",
        "those of [SDOT](sources.md), App. A; what the other packets hold it only lists: their",
        "fields, scales and all ids are chosen here.",
        "",
    ]
    return "\n".join(head) + "\n" + document(load_dictionary("chibis_m"))


def peers_page() -> str:
    """Speed and accuracy next to other programs, from the files that the benchmarks wrote."""
    results, precision = (
        json.loads((ROOT / f"benchmarks/{name}.json").read_text())
        for name in ("results", "precision")
    )
    task, slow, field = results["detumble"], results["slow"], results["field"]
    head = [
        "# Next to other programs",
        "",
        "Made by `docs/generate.py` from what `make bench` and `make bench-precision` measured on",
        f"one machine ({results['machine']['compiler']},",
        f"Python {results['machine']['python']}). Ratios hold for other machines, times do not.",
        "No clock was read before the final states agreed.",
        "",
    ]
    steps = [
        (name.replace("table", "torquer, table").replace("exact", "torquer, exact"), us, ratio)
        for (name, us), ratio in zip(
            task["us_per_step"].items(), task["ratio_to_c++"].values(), strict=True
        )
    ]
    tasks = precision["tasks"].values()
    ways = list(dict.fromkeys(way for each in tasks for way in each["us per s at"]["1e-06 rad"]))
    return "\n".join([
        *head,
        "## One step of an angular motion",
        "",
        "IGRF-14 of degree 13, gravity gradient, B-dot, RK4; plain C++ of this task is 1.",
        "'table': the environment along the orbit is tabulated once. How the programs were",
        "written and what made the difference: [Speed, as measured](../design/0002-speed.md).",
        "",
        "| program | us a step | over C++ |", "|---|---|---|",
        *(f"| {name} | {us:.3g} | {ratio:.3g} |" for name, us, ratio in steps),
        "",
        *_basilisk(slow),
        "SciPy's DOP853 with a right-hand side in Python takes "
        f"{slow['scipy_to_c++']:.0f} times as long as the plain C++.",
        "",
        "## The field alone",
        "",
        "IGRF-14, degree 13, many points; the programs differ by "
        f"{field['difference_nt']:.1g} nT at most.",
        "",
        "| program | ns a point |", "|---|---|",
        *(f"| {name} | {ns:.0f} |" for name, ns in field["ns_per_point"].items()),
        "",
        "## Cost at an error of 1e-6 rad",
        "",
        "Processor time in us per simulated second; `-`: not reached, or not asked. 'auto' is the",
        "default of torquer. More: [Work and precision](../design/0007-work-precision.md).",
        "",
        f"| task | {' | '.join(ways)} |", "|---|" + "---|" * len(ways),
        *(
            f"| {each['title']} | "
            + " | ".join(_us(each["us per s at"]["1e-06 rad"].get(way)) for way in ways) + " |"
            for each in tasks
        ),
        "",
    ])  # fmt: skip


def _basilisk(slow: dict) -> list[str]:
    """What was measured of Basilisk, if it ever was, and when."""
    if "basilisk_to_torquer" not in slow:
        return []
    return [
        f"Basilisk takes {slow['basilisk_to_torquer']['bdot']:.0f} times as long as torquer with",
        f"its table for a second of this motion (measured on {slow['basilisk_measured_on']}).",
    ]


def _us(value: float | None) -> str:
    return np.format_float_positional(value, 2, fractional=False, trim="-") if value else "-"


def commands_page() -> str:
    """Every command with its arguments, options and examples."""
    head = [
        "# Commands",
        "",
        "Made from the code by `docs/generate.py`; `torquer COMMAND --help` prints the same.",
        "MAG and the like: [sources](sources.md).",
        "",
        "",
    ]
    with mock.patch.object(sys, "argv", ["torquer"]):  # usage lines may name the program
        text = app.generate_docs().partition("**Commands**")
    text = text[1] + text[2]
    text = re.sub(r"(`-[^`]*?), --(?:no|empty)-[^`,]+`", r"\1`", text)  # not on the command line
    first, *others = re.split(r"^(?=##+ torquer )", text, flags=re.M)
    sections = [first, *sorted(others, key=lambda section: section.split("\n")[0].strip("# "))]
    return "\n".join(head) + "\n".join(map(_with_examples, sections))


def _with_examples(section: str) -> str:
    """A section of the page of commands, with the examples that `--help` shows."""
    words = re.match(r"##+ torquer (.*)", section)
    lines = EXAMPLES.get(words[1] if words else "", ())
    shown = ["", "Examples:", "", "```sh", *lines, "```"] if lines else []
    return "\n".join([section.rstrip(), *shown, ""])


def where_page() -> str:
    """The page on validity, with the table of conditions as they stand beside the formulas."""
    page = (ROOT / "docs/theory/where-it-holds.md").read_text(encoding="utf-8")
    table = "\n".join(conditions_table(torquer.theory, torquer.design, gallery.theory))
    made, count = re.subn(r"^\| of \|(.*\n\|)*.*$", lambda _: table, page, flags=re.M)
    if count != 1:
        raise ValueError(f"where-it-holds.md: must have one table of conditions; received {count}")
    return made


def mapping_page() -> str:
    """Reference of mappings of telemetry: each key, its examples, formats and quantities."""
    head = [
        "# Mapping of telemetry, key by key",
        "",
        "Made from the code by `docs/generate.py`; `torquer explain mapping` prints the keys. A",
        "mapping is a TOML file that says how a file of telemetry is written and what its columns",
        "are. `torquer telemetry init FILE --orbit ELEMENTS` proposes one. What needs no decision",
        "is read without a key: encodings with a mark, gzip and a ZIP of one file, empty lines,",
        "separators, heads below notes, rows of units, joined exports, JSON, exports of InfluxDB.",
        "For anything else a message names the key. Every example below is a test.",
        "",
    ]
    examples = tomllib.loads((ROOT / "docs/mapping_examples.toml").read_text(encoding="utf-8"))
    tables = mapping_tables()
    keys = [line for table in tables for line in _table(table)]
    parts = [line for each in examples["example"] for line in _mapping_example(each)]
    return "\n".join([*head, *keys, "## Examples", "", *parts, *_mapping_lists()])


def _mapping_example(example: dict) -> list[str]:
    """An example: what it shows, the file, the mapping, what is read."""
    blocks = (("text", "file"), ("toml", "mapping"), ("text", "read"))
    lines = [f"### {', '.join(f'`{key}`' for key in example['keys'])}", "", example["say"], ""]
    for tag, part in blocks:
        lines += [f"```{tag}", example[part].strip("\n"), "```", ""]
    return lines


def _mapping_lists() -> list[str]:
    """Counted formats of stamps, and quantities, as tables."""
    formats = ["| time_format | zero | leap seconds | what it is |", "|---|---|---|---|"]
    formats += [f"| {' | '.join((f'`{row[0]}`', *row[1:]))} |" for row in format_rows()]
    quantities = ["| quantity | columns | units | what it is |", "|---|---|---|---|"]
    quantities += [f"| {' | '.join((f'`{row[0]}`', *row[1:]))} |" for row in quantity_rows()]
    return [
        "## Counted stamps", "",
        f"TICK is one of {', '.join(TICKS)}. A stamp in a leap second, 23:59:60, is read as the",
        "second after it, as everywhere in this package.", "",
        *formats, "", "## Quantities", "",
        "Vectors are in body axes, positions from the Earth's centre; `q_measured` takes the body",
        "to J.", "", *quantities, "",
    ]  # fmt: skip


def satellites_page() -> str:
    """Satellites from their data sheets."""
    return page_of_satellites("en")


def satellites_ru_page() -> str:
    """The same in Russian."""
    return page_of_satellites("ru")


def words_page() -> str:
    """Words of the trade, what they are called here, and the page that answers."""
    rows = [
        f"| {', '.join(each.words)} | {each.here} | {f'`{each.key}`' if each.key else ''} "
        f"| [{title_of(each.page)}]({each.page}.md) |"
        for each in trade_words()
    ]
    return "\n".join([
        "# Words of the trade, and where they are answered", "",
        "Made from the code by `docs/generate.py`. The search of the site finds these words on the",
        "pages that answer them, and `torquer explain WORD` prints the row.", "",
        "| words | called here | key | page |", "|---|---|---|---|", *rows, "",
    ])  # fmt: skip


def title_of(page: str) -> str:
    """The heading of a page below docs/."""
    return (ROOT / f"docs/{page}.md").read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")


PAGES = {
    "telemetry-mapping.md": mapping_page,
    "commands.md": commands_page,
    "peers.md": peers_page,
    "satellites.md": satellites_page,
    "satellites.ru.md": satellites_ru_page,
    "scenario.md": scenario_page,
    "wheel-design.md": wheels_page,
    "equations.md": equations_page,
    "api.md": api_page,
    "variables.md": variables_page,
    "packets.md": packets_page,
    "requirements.md": requirements_page,
    "functions.md": functions_page,
    "words.md": words_page,
    "theory/where-it-holds.md": where_page,
}

if __name__ == "__main__":
    for name in sys.argv[1:]:
        if name not in PAGES:
            raise SystemExit(f"PAGE: must be one of {', '.join(PAGES)}; received {name}")
    for name in sys.argv[1:] or PAGES:
        (ROOT / "docs" / name).write_text(PAGES[name](), encoding="utf-8")
    stored_keys.FILE.write_text(stored_tables(mapping_tables()), encoding="utf-8")
