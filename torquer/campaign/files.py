"""Files that a campaign names: their places, whole paths, and whether code in them may run."""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from torquer.base.explain import key_name
from torquer.base.spec import Spec
from torquer.base.user_code import OwnFile, admit, own_files
from torquer.campaign.spec import Campaign
from torquer.scenario.load import whole_path

#: The key of a law's file; no other key of a scenario names a file.
_FILE = "file"


class CampaignFile(Spec):
    """The part of a file that is about the campaign."""

    campaign: Campaign


def with_whole_paths(data, folder: Path):
    """A campaign's plain data with absolute paths of the files that it names."""

    def whole(place: str, file) -> str:
        return whole_path(place, folder / file)

    if isinstance(data, Mapping) and isinstance(data.get("vary"), Mapping):
        data = {**data, "vary": {k: with_files(k, v, whole) for k, v in data["vary"].items()}}
    if isinstance(data, Mapping) and isinstance(data.get("table"), Mapping):
        changed = {k: _listed_files(k, v, whole) for k, v in data["table"].items()}
        data = {**data, "table": changed}
    return data


def code_named(campaign: Campaign) -> Iterator[tuple[str, Path]]:
    """Places in the campaign's table that name Python files, and the files.

    All values of all keys, also those that no member happens to have, and distributions.
    """
    found: list[tuple[str, Path]] = []

    def note(place: str, file):
        found.append((place, Path(file)))
        return file

    for key, variation in campaign.vary.items():
        with_files(key, {"values": variation.values}, note)
    for key, values in campaign.table.items():
        _listed_files(key, values, note)
    yield from found
    for place, own in own_draws(campaign).items():
        yield f"{place}.file", own.file


def own_draws(campaign: Campaign) -> dict[str, OwnFile]:
    """Distributions that functions of the user's own give, by their places."""
    return own_files(CampaignFile(campaign=campaign))


def with_files(key: str, variation, change: Callable):
    """Plain data of a key's variation with `change(place, file)` for each file that it names."""
    if not isinstance(variation, Mapping):
        return variation
    place, found = ("campaign", "vary", key), dict(variation)
    if "values" in found:
        found["values"] = _change(found["values"], (*place, "values"), _names_file(key), change)
    for within in {"own", "magnitude", "relative"} & found.keys():
        found[within] = _change(found[within], (*place, within), False, change)
    return found


def _listed_files(key: str, values, change: Callable):
    """Values of a key of the table with `change(place, file)` for each file that they name."""
    return _change(values, ("campaign", "table", key), _names_file(key), change)


def _names_file(key: str) -> bool:
    return re.findall(r"[^.\[\]]+", key)[-1:] == [_FILE]


def _change(value, place: tuple, is_file: bool, change: Callable):
    """The value with the files in it changed; `is_file`: whether a text here is one."""
    if isinstance(value, Mapping):
        return {
            key: _change(each, (*place, str(key)), key == _FILE, change)
            for key, each in value.items()
        }
    if isinstance(value, list | tuple):
        return [_change(each, (*place, n), is_file, change) for n, each in enumerate(value)]
    if is_file and isinstance(value, str | Path):
        return change(key_name(place), value)
    return value


def admit_draws(campaign: Campaign) -> None:
    """Let the functions that draw a campaign's members be executed in this process."""
    admit(CampaignFile(campaign=campaign))
