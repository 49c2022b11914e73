"""From a TOML file to a `Scenario`; every mistake becomes one clear line."""

import re
import tomllib
from pathlib import Path

from pydantic import ValidationError

from torquer.scenario.explain import explain, name_of
from torquer.simulation.spec import Scenario

_PRESETS = Path(__file__).with_name("presets")


class ScenarioError(ValueError):
    """What is wrong with a scenario: one line per mistake."""


def load_scenario(path) -> Scenario:
    """The scenario of a TOML file; files it names are looked up beside it."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise ScenarioError(
            f"scenario: must be a readable file; received {path} ({reason})"
        ) from None
    return scenario_from_text(text, re.sub(r"^[.-]|[^\w.-]", "_", path.stem), path.parent)


def scenario_from_text(text: str, name: str = "run", folder: Path = Path()) -> Scenario:
    """The scenario of a TOML text. `name` is used where the text gives none."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario: must be TOML; received: {error}") from None
    data.setdefault("name", name)
    return scenario_from_data(data, folder)


def scenario_from_data(data: dict, folder: Path = Path()) -> Scenario:
    """The scenario of what a TOML text holds, as plain data."""
    data = _with_presets(data, ())
    _find_law_files(data, folder)
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(explain(error, data))) from None


def presets(table: str | None = None) -> dict[str, dict]:
    """Keys of the shipped hardware presets by name: of all, or of those that fit a table."""
    found = {}
    for path in sorted(_PRESETS.glob("*.toml")):
        ((fits, keys),) = tomllib.loads(path.read_text(encoding="utf-8")).items()
        found |= {path.stem: keys} if table in (None, fits) else {}
    return found


def _with_presets(table: dict, place: tuple) -> dict:
    """The table with `preset = "name"` replaced by the preset's keys; keys beside it win."""
    own = {
        key: _with_presets(value, (*place, key)) if isinstance(value, dict) else value
        for key, value in table.items()
    }
    name = own.pop("preset", None)
    if name is None:
        return own
    fitting = presets(place[-1] if place else "")
    if name not in list(fitting):
        where, fit = name_of((*place, "preset")), ", ".join(fitting)
        must = f"be one of {fit}" if fit else "not be given: none fits this table"
        raise ScenarioError(f"{where}: must {must}; received {name!r}")
    return fitting[name] | own


def _find_law_files(data: dict, folder: Path) -> None:
    control = data.get("control") if isinstance(data.get("control"), dict) else {}
    for law in (control.get("law"), control.get("wheel_law")):
        if isinstance(law, dict) and isinstance(law.get("file"), str):
            law["file"] = str((folder / law["file"]).resolve())


def scenario_schema() -> dict:
    """JSON schema of scenario files, for editors; tables of hardware may begin with a preset."""
    schema = Scenario.model_json_schema(mode="validation")
    specs = schema["$defs"]
    for table, told in specs["Spacecraft"]["properties"].items():
        if fitting := presets(table):
            _let_preset_stand(specs[re.search(r"#/\$defs/(\w+)", str(told))[1]], list(fitting))
    return schema


def _let_preset_stand(table: dict, fitting: list[str]) -> None:
    table["properties"]["preset"] = {"enum": fitting, "description": "Shipped hardware preset."}
    if required := table.pop("required", None):
        table["anyOf"] = [{"required": required}, {"required": ["preset"]}]
