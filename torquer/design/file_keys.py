"""All keys of files, of scenarios with their campaigns and of wheel designs: tables, schema."""

import json
from functools import cache

from torquer.campaign.spec import Campaign
from torquer.design.wheel_file import WheelDesign
from torquer.scenario.described import Table
from torquer.scenario.keys import describe, spec_tables
from torquer.scenario.load import scenario_schema
from torquer.scenario.spec import Scenario

PLACE = "campaign"


@cache
def file_tables() -> list[Table]:
    """All tables of a file."""
    return [*spec_tables(Scenario), *spec_tables(Campaign, PLACE)]


@cache
def design_tables() -> list[Table]:
    """All tables of a file of `torquer wheels`."""
    return spec_tables(WheelDesign)


def own_design_tables() -> list[Table]:
    """The tables that only files of `torquer wheels` have, below DESIGN."""
    known = {(table.kind, table.about) for table in file_tables()}
    return [
        table._replace(places=[f"DESIGN.{place}".rstrip(".") for place in table.places])
        for table in design_tables()
        if (table.kind, table.about) not in known
    ]


def stored_tables(mapping: list[Table]) -> str:
    """The text of `stored_tables.json`, from which `torquer explain` answers: a table a line.

    `mapping`: the tables of mappings of telemetry, which is above this floor.
    """
    lists = {"scenario": file_tables(), "design": own_design_tables(), "mapping": mapping}
    parts = []
    for name, tables in lists.items():
        lines = ",\n".join(json.dumps(table, ensure_ascii=False) for table in tables)
        parts.append(f'"{name}": [\n{lines}\n]')
    return "{\n" + ",\n".join(parts) + "\n}\n"


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
