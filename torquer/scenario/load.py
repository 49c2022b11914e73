"""From a TOML file to a `Scenario`; every mistake becomes one clear line."""

import tomllib
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from torquer.simulation.spec import Scenario

_PRESETS = resources.files("torquer.scenario") / "presets"


class ScenarioError(ValueError):
    """What is wrong with a scenario: one line per mistake."""


def load_scenario(path) -> Scenario:
    """The scenario of a TOML file; files it names are looked up beside it."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise ScenarioError(f"scenario: must be a readable file; received {path} ({reason})") from None
    return scenario_from_text(text, path.stem, path.parent)


def scenario_from_text(text: str, name: str = "run", folder: Path = Path()) -> Scenario:
    """The scenario of a TOML text. `name` is used where the text gives none."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario: must be TOML; received: {error}") from None
    data.setdefault("name", name)
    _take_presets(data, ())
    _find_law_file(data, folder)
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(explain(error))) from None


def presets() -> list[str]:
    """Names of the shipped hardware presets."""
    return sorted(p.name.removesuffix(".toml") for p in _PRESETS.iterdir() if p.name.endswith(".toml"))


def _take_presets(table: dict, place: tuple) -> None:
    """Replace `preset = "name"` in a table by the preset's keys; keys beside it win."""
    for key, value in table.items():
        if isinstance(value, dict):
            _take_presets(value, (*place, key))
    name = table.pop("preset", None)
    if name is None:
        return
    where = ".".join((*place, "preset"))
    if name not in presets():
        raise ScenarioError(
            f"{where}: must be one of {', '.join(presets())}; received {name!r}"
        )
    preset = tomllib.loads((_PRESETS / f"{name}.toml").read_text(encoding="utf-8"))
    for key, value in preset.items():
        table.setdefault(key, value)


def _find_law_file(data: dict, folder: Path) -> None:
    law = data.get("control", {}).get("law") if isinstance(data.get("control"), dict) else None
    if isinstance(law, dict) and isinstance(law.get("file"), str):
        law["file"] = str((folder / law["file"]).resolve())


def explain(error: ValidationError) -> list[str]:
    """One line per mistake: the key, what must hold, what was received."""
    return [_line(e) for e in error.errors()]


def _line(e: dict) -> str:
    kinds = {"function-before", "function-after"}
    key = ".".join(str(part) for part in e["loc"] if str(part) not in kinds) or "scenario"
    received = e["input"]
    if e["type"] == "missing":
        return f"{key}: must be given; received nothing"
    if e["type"] == "extra_forbidden":
        return f"{key}: unknown key; received {received!r}"
    if e["type"] == "value_error":
        text = str(e["ctx"]["error"])
        name, _, rest = text.partition(": ")
        return f"{key}: {rest}" if key.endswith(name) and rest else f"{key}: {text}"
    if e["type"] == "union_tag_not_found":
        return f"{key}.kind: must be given, one of {e['ctx'].get('expected_tags', 'the known kinds')}"
    if e["type"] == "union_tag_invalid":
        tag = e["ctx"]["tag"]
        return f"{key}.kind: must be one of {e['ctx']['expected_tags']}; received {tag!r}"
    message = e["msg"][0].lower() + e["msg"][1:]
    message = message.removeprefix("input should be ").removeprefix("value should ")
    return f"{key}: must be {message}; received {received!r}"


def scenario_schema() -> dict:
    """JSON schema of scenario files, for editors."""
    return Scenario.model_json_schema(mode="validation")
