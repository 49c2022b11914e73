"""A designed law as text for a scenario."""

import json


def law_toml(keys: dict) -> str:
    """A law's keys as the table `[control.law]` of a scenario."""
    rows = (f"{key} = {json.dumps(value)}" for key, value in keys.items())
    return "\n".join(["[control.law]", *rows, ""])
