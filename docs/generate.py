"""Make docs/scenario.md and docs/equations.md from the code: `python docs/generate.py`."""

import ast
import inspect
import re
from pathlib import Path

from pydantic import BaseModel

from torquer.control import LAWS, WHEEL_LAWS, GivenLaw
from torquer.earth.atmosphere import ATMOSPHERES
from torquer.environment.along_orbit import Environment
from torquer.environment.field import FIELDS
from torquer.orbit import ORBITS
from torquer.orbit.numerical import STARTS, Drag
from torquer.scenario.load import presets
from torquer.scenario.spec import Control, InitialMotion, Scenario, Simulation, Spacecraft
from torquer.spacecraft.aerodynamics import Aerodynamics, Cylinder, Plate, Sphere
from torquer.spacecraft.attitude_sensor import AttitudeSensor
from torquer.spacecraft.body import Body
from torquer.spacecraft.coils import Coils
from torquer.spacecraft.disturbance import Disturbance
from torquer.spacecraft.gyro import Gyro
from torquer.spacecraft.magnetometer import Magnetometer
from torquer.spacecraft.sun_sensor import SunSensors
from torquer.spacecraft.wheels import Failure, ReactionWheels
from torquer.wheel_array.presets import LAYOUTS

ROOT = Path(__file__).parents[1]
#: Tables of a scenario file, in the order of the page.
TABLES = {
    "(top of the file)": Scenario,
    **{f"orbit, kind = {kind!r}": spec for kind, spec in ORBITS.items()},
    **{f"orbit.start, kind = {kind!r} (numerical)": s for kind, s in STARTS.items()},
    "orbit.drag (numerical)": Drag,
    "environment": Environment,
    **{f"environment.field, kind = {kind!r}": spec for kind, spec in FIELDS.items()},
    **{f"environment.atmosphere, kind = {kind!r}": s for kind, s in ATMOSPHERES.items()},
    "spacecraft": Spacecraft,
    "spacecraft.body": Body,
    "spacecraft.coils": Coils,
    "spacecraft.wheels": ReactionWheels,
    "spacecraft.wheels.failures": Failure,
    **{f"spacecraft.wheels.layout, kind = {kind!r}": s for kind, s in LAYOUTS.items()},
    "spacecraft.magnetometer": Magnetometer,
    "spacecraft.gyro": Gyro,
    "spacecraft.sun_sensors": SunSensors,
    "spacecraft.attitude_sensor": AttitudeSensor,
    "spacecraft.aerodynamics": Aerodynamics,
    "spacecraft.aerodynamics.parts, kind = 'cylinder'": Cylinder,
    "spacecraft.aerodynamics.parts, kind = 'plate'": Plate,
    "spacecraft.aerodynamics.parts, kind = 'sphere'": Sphere,
    "disturbance": Disturbance,
    "initial": InitialMotion,
    "control": Control,
    **{f"control.law, kind = {kind!r}": spec for kind, spec in LAWS.items()},
    "control.law, kind = 'given_in_python'": GivenLaw,
    **{f"control.wheel_law, kind = {kind!r}": spec for kind, spec in WHEEL_LAWS.items()},
    "simulation": Simulation,
}
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
        'keys. In a table of hardware, `preset = "name"` takes the keys of a shipped preset',
        "(" + "; ".join(_presets_told()) + "); keys beside it win.",
        "",
    ]
    return "\n".join(head + [line for name, spec in TABLES.items() for line in _table(name, spec)])


def _presets_told() -> list[str]:
    """Each table of hardware that has presets, with their names."""
    fitting = {table: presets(table) for table in Spacecraft.model_fields}
    return [f"`{table}`: {', '.join(names)}" for table, names in fitting.items() if names]


def _table(name: str, spec) -> list[str]:
    rows = [f"| `{key}` | {_default(key, field)} |" for key, field in spec.model_fields.items()]
    text = inspect.cleandoc(spec.__doc__ or "")
    return [f"## {name}", "", text, "", "| key | default |", "|---|---|", *rows, ""]


def _default(key: str, field) -> str:
    if field.is_required():
        return "**must be given**"
    if field.default_factory is not None:
        return f"`{field.default_factory()!r}`"
    if isinstance(field.default, BaseModel):
        return "its own defaults" if key != "kind" else f"`{field.default!r}`"
    return f"`{field.default!r}`"


def citations_of(docstring: str) -> list[tuple[str, str]]:
    """(key, number) of all formulas that a docstring is the home of."""
    return [c for found in SOURCE.findall(docstring) for c in _CITED.findall(found)]


def docstrings_of(source: str):
    """(name, docstring) of a module and all that is in it."""
    described = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, described) and (text := ast.get_docstring(node)):
            yield getattr(node, "name", "module"), text


def all_docstrings():
    """(place, docstring) of everything in the package."""
    for path in sorted((ROOT / "torquer").rglob("*.py")):
        for name, text in docstrings_of(path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(ROOT).as_posix()}: `{name}`", text


def sources() -> list[tuple[str, str, str]]:
    """(key, number, place) of every published formula that has its home in the package."""
    return [(*c, place) for place, text in all_docstrings() for c in citations_of(text)]


def equations_page() -> str:
    """Index of published formulas and their one home in the code."""
    order = sorted(sources(), key=lambda s: (s[0], [int(n) for n in s[1].split(".")]))
    rows = [f"| {key} ({number}) | {place} |" for key, number, place in order]
    head = ["# Index of published formulas", "", "Made from the code by `docs/generate.py`.", ""]
    return "\n".join([*head, "| formula | home |", "|---|---|", *rows, ""])


PAGES = {"scenario.md": scenario_page, "equations.md": equations_page}

if __name__ == "__main__":
    for name, make in PAGES.items():
        (ROOT / "docs" / name).write_text(make(), encoding="utf-8")
