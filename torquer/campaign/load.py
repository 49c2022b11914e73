"""From a TOML file to a scenario and its campaign; every mistake becomes one clear line."""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from torquer.base.spec import Spec
from torquer.base.user_code import OwnFile, admit, own_files
from torquer.campaign.outcomes import check_outcomes
from torquer.campaign.plain import with_flat_keys
from torquer.campaign.sampling import Drawn, as_changes, draw, draw_values
from torquer.campaign.spec import Campaign
from torquer.campaign.table import read_table, telling_rows
from torquer.campaign.variation import ATTITUDE, Variation
from torquer.scenario.change import with_values
from torquer.scenario.explain import key_name, validate_tables
from torquer.scenario.held import held_attitudes
from torquer.scenario.load import (
    ScenarioError,
    name_after,
    parse_toml,
    read_text,
    scenario_from_data,
    whole_path,
)
from torquer.scenario.spec import Scenario

#: Members that are tried before a campaign is flown.
_TRIED = 8
#: Greatest number of values of a list that are tried.
_MOST_VALUES = 100
#: The key of a law's file; no other key of a scenario names a file.
_FILE = "file"


class _File(Spec):
    """The part of a file that is about the campaign."""

    campaign: Campaign


def load_campaign(path) -> tuple[Scenario, Campaign]:
    """The scenario of a TOML file and the campaign in its table `[campaign]`.

    >>> varied, campaign = torquer.load_campaign("releases.toml")
    >>> campaign.runs
    4
    """
    path = Path(path)
    data = {"name": name_after(path), **parse_toml(read_text(path, "scenario"), "scenario")}
    scenario = scenario_from_data(data, path.parent)
    if "campaign" not in data:
        raise ScenarioError(
            "campaign: must be given, a table [campaign] with runs, vary and outcomes; received "
            "nothing (`torquer explain campaign`; example: examples/tip_off_campaign.toml)"
        )
    return scenario, campaign_from_data(data["campaign"], scenario, path.parent)


def campaign_from_data(table: dict, scenario: Scenario, folder: Path = Path()) -> Campaign:
    """The campaign of plain data, checked with the scenario that it varies.

    The file of its members, and files of laws among the values, are relative to the folder.
    """
    given = _with_table(table, folder)
    try:
        data = with_flat_keys(given)
    except ValueError as error:
        raise ScenarioError(f"campaign.{error}") from None
    campaign = validate_tables(_File, {"campaign": _with_whole_paths(data, folder)}).campaign
    check_campaign(campaign, scenario)
    return campaign


def _with_table(data, folder: Path):
    """A campaign's plain data with what the file of its members holds."""
    if not isinstance(data, Mapping) or not isinstance(data.get("table"), str):
        return data
    return {**data, "table": read_table(Path(whole_path("campaign.table", folder / data["table"])))}


def _with_whole_paths(data, folder: Path):
    """A campaign's plain data with absolute paths of the files among its values."""

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

    All values of all keys, also those that no member happens to have.
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


def with_files(key: str, variation, change: Callable):
    """Plain data of a key's variation with `change(place, file)` for each file that it names."""
    if not isinstance(variation, Mapping) or "values" not in variation:
        return variation
    place = ("campaign", "vary", key, "values")
    values = _change(variation["values"], place, _names_file(key), change)
    return {**variation, "values": values}


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


def check_campaign(campaign: Campaign, scenario: Scenario) -> None:
    """ScenarioError unless members can be flown and have the outcomes.

    The first members and the ends of all distributions are tried; for distributions without ends,
    the values that one in twice as many members exceeds; of a table the members with the least and
    greatest numbers.
    """
    try:
        check_outcomes(campaign.outcomes, scenario)
    except ValueError as error:
        raise ScenarioError(str(error)) from None
    for member, _ in _tried_members(campaign, scenario):
        _check_held(campaign, scenario, member)


def check_own_parts(campaign: Campaign, scenario: Scenario) -> None:
    """ScenarioError for a key of the user's own parts that varies and that their functions lack.

    Their files are executed, if keys of them vary.
    """
    if not any(_varied(campaign, key) for key in _executed(scenario)):
        return
    for member, keys in _tried_members(campaign, scenario):
        admit(member)
        for key, part in _executed(member).items():
            if not _varied(campaign, key):
                continue
            try:
                part.check_parameters()
            except ValueError as error:
                raise ScenarioError(_text(str(error), keys, campaign)) from None


def _executed(scenario: Scenario) -> dict[str, OwnFile]:
    return {key: part for key, part in own_files(scenario).items() if part.executes}


def _varied(campaign: Campaign, part: str) -> bool:
    """Whether a key of a part varies."""
    return any(key.startswith(f"{part}.") for key in campaign.varied_keys)


def _tried_members(campaign: Campaign, scenario: Scenario) -> Iterator[tuple[Scenario, list[str]]]:
    """The members that are tried, and the keys that vary."""
    first = np.arange(min(_TRIED, campaign.runs))
    telling = telling_rows(campaign.table, _MOST_VALUES)
    members = np.union1d(first, telling[telling < campaign.runs])
    units = _ends(campaign)
    for drawn, named in (
        (draw(campaign, scenario, members), members.tolist()),
        (draw_values(campaign, scenario, units), [None] * len(units)),
    ):
        for row, member in enumerate(named):
            yield _member(campaign, scenario, drawn, row, member), [*drawn]


def _ends(campaign: Campaign) -> np.ndarray:
    """Unit numbers [n, k] of members to try: lowest and highest ends, then values of lists."""
    lists = [len(each.values) for each in campaign.vary.values() if each.values is not None]
    rows = np.arange(2 + min(max(lists, default=0), _MOST_VALUES))
    rare = 0.5 / campaign.runs
    of_keys = (_with_its_tied(campaign, key) for key in campaign.drawn_alone)
    columns = [_rare_ends(variations, rows, rare) for variations in of_keys]
    for together in campaign.correlated:
        columns += [_low_and_high(rows, rare)] * together.unit_numbers
    return np.column_stack(columns) if columns else np.empty((len(rows), 0))


def _with_its_tied(campaign: Campaign, key: str) -> list[Variation]:
    """The variations that share the draw of a key, its own first."""
    return [campaign.vary[key], *(v for v in campaign.vary.values() if v.tied_to == key)]


def _rare_ends(variations: list[Variation], rows: np.ndarray, rare: float) -> np.ndarray:
    """Unit numbers [n, unit_numbers] of variations with one draw."""
    lists = [len(each.values) for each in variations if each.values is not None]
    if lists:
        return (rows % lists[0] + 0.5) / lists[0]
    bounded = all(each.is_bounded for each in variations)
    ends = _low_and_high(rows, 0.0 if bounded else rare)
    return np.tile(ends[:, None], (1, variations[0].unit_numbers))


def _low_and_high(rows: np.ndarray, low: float) -> np.ndarray:
    """The low end, the high end, and the median in all further rows."""
    return np.where(rows == 0, low, np.where(rows == 1, 1.0 - low, 0.5))


def _member(
    campaign: Campaign, scenario: Scenario, drawn: Drawn, row: int, member: int | None
) -> Scenario:
    """The scenario of a row, that of a member or of none; ScenarioError in the campaign's terms."""
    try:
        return with_values(scenario, as_changes(drawn, row))
    except ScenarioError as error:
        keys = [*drawn]
        lines = [_text(line, keys, campaign, member) for line in str(error).split("\n")]
        raise ScenarioError("\n".join(lines)) from None


def _text(line: str, keys: list[str], campaign: Campaign, member: int | None = None) -> str:
    """A line about a member's scenario, led by the key that varies if it is about one.

    Of a key in the table it ends with the member.
    """
    about, _, rest = line.partition(": ")
    for key in sorted(keys, key=len, reverse=True):
        changed = "initial.quaternion" if key == ATTITUDE else key
        if about == changed or about.startswith((f"{changed}.", f"{changed}[")):
            tables = (name for name in ("table", "vary") if key in getattr(campaign, name))
            table = next(tables, "correlated")
            of = f" (member {member})" if table == "table" and member is not None else ""
            return f"{key_name(('campaign', table, key))}{about.removeprefix(changed)}: {rest}{of}"
    table = "vary" if campaign.vary or not campaign.table else "table"
    return f"campaign.{table}: members must be scenarios that can be flown; received {line}"


def _check_held(campaign: Campaign, scenario: Scenario, member: Scenario) -> None:
    """The attitude error of all members is measured from one attitude."""
    asked = any(each.signal == "attitude_error_deg" for each in campaign.outcomes.values())
    if asked and held_attitudes(member.control) != held_attitudes(scenario.control):
        raise ScenarioError(
            "campaign.vary: the attitude that laws hold must not vary with an outcome of "
            "attitude_error_deg; received members that hold different ones"
        )
