"""From a TOML file to a `Scenario`; every mistake becomes one clear line."""

import re
import tomllib
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from torquer.scenario.explain import explain, name_of
from torquer.simulation.spec import Scenario

_PRESETS = resources.files("torquer.scenario") / "presets"


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


def presets() -> list[str]:
    """Names of the shipped hardware presets."""
    names = (path.name for path in _PRESETS.iterdir())
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def _with_presets(table: dict, place: tuple) -> dict:
    """The table with `preset = "name"` replaced by the preset's keys; keys beside it win."""
    own = {
        key: _with_presets(value, (*place, key)) if isinstance(value, dict) else value
        for key, value in table.items()
    }
    name = own.pop("preset", None)
    if name is None:
        return own
    if name not in presets():
        where = name_of((*place, "preset"))
        raise ScenarioError(f"{where}: must be one of {', '.join(presets())}; received {name!r}")
    return tomllib.loads((_PRESETS / f"{name}.toml").read_text(encoding="utf-8")) | own


def _find_law_files(data: dict, folder: Path) -> None:
    control = data.get("control") if isinstance(data.get("control"), dict) else {}
    for law in (control.get("law"), control.get("wheel_law")):
        if isinstance(law, dict) and isinstance(law.get("file"), str):
            law["file"] = str((folder / law["file"]).resolve())


def scenario_schema() -> dict:
    """JSON schema of scenario files, for editors; any table may begin with a preset."""
    schema = Scenario.model_json_schema(mode="validation")
    for table in schema["$defs"].values():
        if table.get("type") == "object":
            _let_preset_stand(table)
    return schema


def _let_preset_stand(table: dict) -> None:
    table["properties"]["preset"] = {"enum": presets(), "description": "Shipped hardware preset."}
    if required := table.pop("required", None):
        table["anyOf"] = [{"required": required}, {"required": ["preset"]}]
