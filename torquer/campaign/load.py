"""From a TOML file to a scenario and its campaign; every mistake becomes one clear line."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from torquer.base.explain import key_name, validate_tables
from torquer.base.user_code import OwnFile, admit, own_files
from torquer.campaign.files import CampaignFile, admit_draws, own_draws, with_whole_paths
from torquer.campaign.outcomes import check_outcomes
from torquer.campaign.own_draws import RefusedDraw
from torquer.campaign.plain import with_flat_keys
from torquer.campaign.sampling import Drawn, as_changes, draw, draw_values, units_by_group
from torquer.campaign.spec import Campaign
from torquer.campaign.table import read_table, telling_rows
from torquer.campaign.unit_numbers import unit_numbers
from torquer.campaign.variation import ATTITUDE, Variation
from torquer.scenario.change import with_values
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
#: Members that a function of the user's own draws before; of them those with least and most of
#: anything are tried.
_DRAWN = 10_000


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
    campaign = validate_tables(CampaignFile, {"campaign": with_whole_paths(data, folder)}).campaign
    admit_draws(campaign)  # executed where members are drawn, not here
    check_campaign(campaign, scenario)
    return campaign


def _with_table(data, folder: Path):
    """A campaign's plain data with what the file of its members holds."""
    if not isinstance(data, Mapping) or not isinstance(data.get("table"), str):
        return data
    return {**data, "table": read_table(Path(whole_path("campaign.table", folder / data["table"])))}


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
    if not own_draws(campaign):  # else they are executed, by `check_own_parts`
        _check_members(campaign, scenario)


def _check_members(campaign: Campaign, scenario: Scenario) -> None:
    for member, _ in _tried_members(campaign, scenario):
        _check_held(campaign, scenario, member)


def check_own_parts(campaign: Campaign, scenario: Scenario) -> None:
    """ScenarioError for members that functions of the user's own draw and that cannot be flown, and
    for a key of the user's own parts that varies and that their functions lack.

    The files are executed: of distributions, and of parts of which keys vary.
    """
    if own_draws(campaign):
        admit_draws(campaign)
        _check_draws(campaign)
        _check_members(campaign, scenario)
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


def _check_draws(campaign: Campaign) -> None:
    """ScenarioError for a function that does not draw the first members, or not twice alike."""
    members = np.arange(min(campaign.runs, _TRIED))
    parts = units_by_group(campaign, unit_numbers(campaign, members))
    for key, variation in campaign.vary.items():
        if (own := variation.own_draws) is None:
            continue
        units = parts[variation.tied_to or key]
        try:
            own.check_repeats(units[:, -own.draws :])  # those of a direction come first
        except RefusedDraw as error:
            raise ScenarioError(str(error.of(members))) from None


def _telling_draws(campaign: Campaign, scenario: Scenario) -> np.ndarray:
    """Of members that functions of the user's own draw, those that have least and most."""
    if not own_draws(campaign):
        return np.zeros(0, np.int64)
    drawn = draw(campaign, scenario, np.arange(min(campaign.runs, _DRAWN)))
    own = [key for key, each in campaign.vary.items() if each.own_draws]
    return telling_rows({key: np.asarray(drawn[key]).tolist() for key in own}, 1)


def _executed(scenario: Scenario) -> dict[str, OwnFile]:
    return {key: part for key, part in own_files(scenario).items() if part.executes}


def _varied(campaign: Campaign, part: str) -> bool:
    """Whether a key of a part varies."""
    return any(key.startswith(f"{part}.") for key in campaign.varied_keys)


def _tried_members(campaign: Campaign, scenario: Scenario) -> Iterator[tuple[Scenario, list[str]]]:
    """The members that are tried, and the keys that vary."""
    first = np.arange(min(_TRIED, campaign.runs))
    telling = telling_rows(campaign.table, _MOST_VALUES)
    telling = np.append(telling, _telling_draws(campaign, scenario))
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
    if any(each.own_draws for each in variations):  # only those of members are tried
        return np.full((len(rows), variations[0].unit_numbers), 0.5)
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

    Of a key in the table, or of one that a function draws, it ends with the member.
    """
    about, _, rest = line.partition(": ")
    for key in sorted(keys, key=len, reverse=True):
        changed = "initial.quaternion" if key == ATTITUDE else key
        if about == changed or about.startswith((f"{changed}.", f"{changed}[")):
            table = _table_of(campaign, key)
            own = campaign.vary[key].own_draws if table == "vary" else None
            by = f"{own.function_in_words()}, " if own else ""
            is_named = (by or table == "table") and member is not None
            of = f" ({by}member {member})" if is_named else ""
            return f"{key_name(('campaign', table, key))}{about.removeprefix(changed)}: {rest}{of}"
        if changed.startswith(f"{about}.") and rest.startswith("must be a table to change a key"):
            return f"{key_name(('campaign', _table_of(campaign, key), key))}: {line}"
    table = "vary" if campaign.vary or not campaign.table else "table"
    return f"campaign.{table}: members must be scenarios that can be flown; received {line}"


def _table_of(campaign: Campaign, key: str) -> str:
    """Where in the campaign a key varies."""
    tables = (name for name in ("table", "vary") if key in getattr(campaign, name))
    return next(tables, "correlated")


def _check_held(campaign: Campaign, scenario: Scenario, member: Scenario) -> None:
    """The attitude error of all members is measured from one attitude."""
    asked = any(each.signal == "attitude_error_deg" for each in campaign.outcomes.values())
    if asked and held_attitudes(member.control) != held_attitudes(scenario.control):
        raise ScenarioError(
            "campaign.vary: the attitude that laws hold must not vary with an outcome of "
            "attitude_error_deg; received members that hold different ones"
        )
