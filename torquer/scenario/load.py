"""From a TOML file to a `Scenario`; every mistake becomes one clear line."""

import copy
import functools
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from torquer.base.explain import ScenarioError, key_name, validate_tables
from torquer.base.user_code import admit, remember_keys
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import parse_toml, read_text
from torquer.spacecraft.sensors.devices import SEVERAL, SUN_HEADS_TWICE, by_name

_PRESETS = Path(__file__).with_name("presets")


def load_scenario(path, *, code: bool = True) -> Scenario:
    """The scenario of a TOML file; paths in it are relative to its folder.

    `code`: whether the Python files that give parts of its surroundings may be executed; they are
    when those are evaluated, not here.

        >>> torquer.load_scenario("satellite.toml").orbit.altitude_km
        550.0
    """
    path = Path(path)
    text = read_text(path, "scenario")
    return scenario_from_text(text, name_after(path), path.parent, code=code)


def scenario_from_text(
    text: str, name: str = "run", folder: Path = Path(), *, code: bool = True
) -> Scenario:
    """The scenario of a TOML text. `name` is used where the text gives none.

    >>> from pathlib import Path
    >>> read = torquer.scenario_from_text(Path("satellite.toml").read_text(), name="satellite")
    >>> read.name
    'satellite'
    """
    return scenario_from_data({"name": name, **parse_toml(text, "scenario")}, folder, code=code)


def name_after(path: Path) -> str:
    """The name of a scenario or design from its file, for a text that gives none."""
    return re.sub(r"^[.-]|[^\w.-]", "_", path.stem)


def scenario_from_data(data: dict, folder: Path = Path(), *, code: bool = True) -> Scenario:
    """The scenario of what a TOML text holds, as plain data."""
    if {"wheels", "body"} <= data.keys() and "spacecraft" not in data:
        raise ScenarioError("spacecraft: must be given; received a file of `torquer wheels`")
    data = with_presets(_without_campaign(data))
    _find_files(data, folder)
    scenario = validate_tables(Scenario, data)
    remember_keys(scenario)
    if code:
        admit(scenario)
    return scenario


def _without_campaign(data: dict) -> dict:
    """The data without the table of a campaign, which is no part of a single run.

    Its keys are checked where campaigns are flown (`torquer.campaign`), not here.
    """
    campaign = data.get("campaign", {})
    if not isinstance(campaign, dict):
        raise ScenarioError(f"campaign: must be a table of keys; received {campaign!r}")
    return {key: value for key, value in data.items() if key != "campaign"}


@functools.cache
def _read_shipped() -> dict[str, tuple[str, dict]]:
    """What each shipped preset fits, and its keys, by name; read once, not to be changed."""
    files = sorted(_PRESETS.glob("*.toml"))
    tables = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in files}
    return {name: next(iter(table.items())) for name, table in tables.items()}


def presets(table: str | None = None) -> dict[str, dict]:
    """Keys of the shipped presets by name, of all or of those that fit a table.

    They are shared: to be read, not changed.
    """
    return {name: keys for name, (fits, keys) in _read_shipped().items() if table in (None, fits)}


def with_presets(table: dict, place: tuple = ()) -> dict:
    """The table with `preset = "name"` replaced by the preset's keys; keys next to it win.

    Sensors in a list become tables by name: their keys are then the same everywhere.
    """
    table = _with_names(table) if place == ("spacecraft",) else table
    own = {
        key: with_presets(value, (*place, key)) if isinstance(value, dict) else value
        for key, value in table.items()
    }
    name = own.pop("preset", None)
    if name is None:
        return own
    fitting = presets(_fits(place))
    if name not in list(fitting):
        where, fit = key_name((*place, "preset")), ", ".join(fitting)
        must = f"be one of {fit}" if fit else "not be given: none fits this table"
        raise ScenarioError(f"{where}: must {must}; received {name!r}")
    return copy.deepcopy(fitting[name]) | own


def _with_names(craft: dict) -> dict:
    """The spacecraft with several sensors by name that stand in lists."""
    found = {}
    for key, value in craft.items():
        named = "sun_heads" if key == "sun_sensors" else key
        if named not in SEVERAL or not isinstance(value, list):
            found[key] = value
            continue
        if named in craft and named != key:
            raise ScenarioError(f"spacecraft.{SUN_HEADS_TWICE}")
        try:
            found[named] = by_name(value)
        except ValueError as error:
            raise ScenarioError(f"spacecraft.{key}{error}") from None
    return found


def _fits(place: tuple) -> str:
    """What a preset at a place must fit: a table by its name, or any region of modes."""
    if place[:-1] == ("control", "modes", "regions"):
        return "region"
    if place[:1] == ("spacecraft",) and len(place) == 3 and place[1] in SEVERAL:
        return SEVERAL[place[1]].name
    return place[-1] if place else ""


def _find_files(data: dict, folder: Path) -> None:
    """Absolute paths in place of those relative to the folder."""
    for key, table in tables_with_files(data):
        table["file"] = whole_path(f"{key}.file", folder / table["file"])


def tables_with_files(data, place: str = "") -> Iterator[tuple[str, dict]]:
    """Tables of a scenario's data that name a file, with their keys: code to execute, or data."""
    if isinstance(data, dict):
        if place and isinstance(data.get("file"), str):
            yield place, data
        for name, value in data.items():
            yield from tables_with_files(value, f"{place}.{name}".lstrip("."))
    elif isinstance(data, list | tuple):
        for k, value in enumerate(data):
            yield from tables_with_files(value, f"{place}[{k}]")


def whole_path(key: str, path: Path) -> str:
    """The absolute path, as text that can be stored."""
    try:
        whole = str(path.resolve())
        whole.encode()
    except (OSError, ValueError, RuntimeError) as error:
        raise ScenarioError(
            f"{key}: must be a path in the encoding of the file system "
            f"({sys.getfilesystemencoding()}) and in UTF-8; received {str(path)!r} ({error})"
        ) from None
    return whole


def check_orbit_environment(scenario: Scenario) -> None:
    """ValueError if field, date, orbit or air of a scenario cannot be used.

    The models are evaluated at both ends of the run and along the first orbit.
    """
    end_s = scenario.length_s
    t_s = np.append(np.linspace(0.0, min(end_s, scenario.orbit.period_s), 50), end_s)
    environment = scenario.orbit_environment()
    environment.check_dates(*t_s[[0, -1]])
    environment.sample(t_s)
    believed = scenario.believed_environment()
    believed.check_dates(*t_s[[0, -1]])
    believed.field(t_s, *believed.state(t_s))
    if not scenario.spacecraft.aerodynamics:
        return
    with np.errstate(invalid="ignore"):
        known = np.isfinite(environment.flow(t_s)).all()
    if not known:
        raise ValueError(
            "environment.atmosphere: must have a density of 0 or more along the orbit; received a "
            "negative one (as gost has for f107 far below f81) or one beyond the range of "
            "floating-point numbers"
        )


def scenario_schema() -> dict:
    """JSON schema of scenario files, for editors; tables of hardware may begin with a preset.

    >>> torquer.scenario_schema()["required"]
    ['start', ...]
    """
    from torquer.scenario.keys import describe  # which reads the source of all specs

    schema = Scenario.model_json_schema(mode="validation")
    describe(schema, Scenario)
    specs = schema["$defs"]
    for table, text in specs["Spacecraft"]["properties"].items():
        if fitting := presets(table):
            _let_preset_stand(specs[re.search(r"#/\$defs/(\w+)", str(text))[1]], list(fitting))
    _let_preset_stand(specs["Region"], [*presets("region")])
    _let_modes_be_short(specs)
    schema["properties"]["campaign"] = {
        "type": "object",
        "description": "Many runs with varied keys.",
    }
    return schema


def _let_modes_be_short(specs: dict) -> None:
    """The short forms of mode tables: one region's keys, one condition, laws without factors."""
    modes, state, transition = specs["Modes"], specs["State"]["properties"], specs["Transition"]
    modes["properties"] |= specs["Region"]["properties"]
    modes.pop("required", None)
    names = {"type": "array", "items": {"type": "string"}}
    state["laws"] = _either(state["laws"], names)
    when = transition["properties"]["when"]
    transition["properties"]["when"] = _either(when, {"$ref": "#/$defs/Condition"})


def _either(long: dict, short: dict) -> dict:
    """Either of two forms of a key, described as the long one."""
    return {"description": long["description"], "anyOf": [long, short]}


def _let_preset_stand(table: dict, fitting: list[str]) -> None:
    table["properties"]["preset"] = {
        "enum": fitting,
        "description": "Shipped preset; keys given next to it take precedence.",
    }
    if required := table.pop("required", None):
        table["anyOf"] = [{"required": required}]
    if "anyOf" in table:
        table["anyOf"] = [*table["anyOf"], {"required": ["preset"]}]
