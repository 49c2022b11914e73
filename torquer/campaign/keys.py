"""All keys of files, of scenarios with their campaigns and of wheel designs: tables, schema."""

import difflib
import re
from functools import cache

from torquer.analysis.wheel_file import WheelDesign
from torquer.campaign.spec import Campaign
from torquer.scenario.keys import Key, Table, describe, tables_of
from torquer.scenario.load import scenario_schema
from torquer.scenario.spec import Scenario

PLACE = "campaign"


@cache
def file_tables() -> list[Table]:
    """All tables of a file."""
    return [*tables_of(Scenario), *tables_of(Campaign, PLACE)]


@cache
def design_tables() -> list[Table]:
    """All tables of a file of `torquer wheels`."""
    return tables_of(WheelDesign)


@cache
def _all_tables() -> list[Table]:
    """All tables of scenario files, and below DESIGN those that only wheel designs have."""
    known = {(table.kind, table.about) for table in file_tables()}
    own = [
        table._replace(places=[f"DESIGN.{place}".rstrip(".") for place in table.places])
        for table in design_tables()
        if (table.kind, table.about) not in known
    ]
    return [*file_tables(), *own]


def file_schema() -> dict:
    """JSON schema of scenario files with their campaigns, for editors."""
    schema = scenario_schema()
    campaign = Campaign.model_json_schema(mode="validation")
    describe(campaign, Campaign)
    schema["$defs"] |= campaign.pop("$defs") | {"Campaign": campaign}
    schema["properties"]["campaign"] = {
        "$ref": "#/$defs/Campaign",
        "description": "Many runs of the scenario, with varied keys.",
    }
    return schema


def find(name: str) -> tuple[list[Table], list[tuple[Table, Key]]]:
    """The tables, and the keys with their tables, that a name may mean.

    A name is a whole key ("spacecraft.coils.limit_a_m2"), a table ("spacecraft.coils"), the end
    of one of them ("coils", "limit_a_m2") or the kind of a table ("bdot"). `ValueError` with the
    nearest names for one that means nothing.
    """
    asked = _words(name)
    keys = [
        (table, key)
        for table in _all_tables()
        for key in table.keys
        if any(_ends_with(_words(f"{place}.{key.name}"), asked) for place in table.places)
    ]
    tables = [
        table
        for table in _all_tables()
        if [table.kind] == asked
        or any(place and _ends_with(_words(place), asked) for place in table.places)
    ]
    if not tables and not keys:
        word = asked[-1] if asked else ""
        near = difflib.get_close_matches(word, _known(), n=3, cutoff=0.7)
        near = near or [key for key in _known() if word and word in key.split("_")][:3]
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        raise ValueError(
            "KEY: must be a key or table of scenario files or wheel designs; received "
            f"{name!r}{hint}"
        )
    return tables, keys


def _known() -> list[str]:
    keys = [key.name for table in _all_tables() for key in table.keys]
    kinds = [table.kind for table in _all_tables() if table.kind]
    return list(dict.fromkeys([*keys, *kinds]))


def _words(place: str) -> list[str]:
    """Words of a dotted place, without numbers of elements."""
    return [word for word in re.sub(r"\[\d*\]", "", place).split(".") if word]


def _ends_with(place: list[str], asked: list[str]) -> bool:
    """Whether a place ends as asked; NAME stands for any name, but not for the first word."""
    end = place[-len(asked) :]
    return len(end) == len(asked) > 0 and all(
        ours == word or (ours == "NAME" and n > 0)
        for n, (ours, word) in enumerate(zip(end, asked, strict=True))
    )
