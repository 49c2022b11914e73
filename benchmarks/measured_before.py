"""Results of programs that are not installed on this machine: they stay as they were measured."""

import json
from pathlib import Path


def measured_before(results: Path, part: str, name: str) -> dict:
    """What a file of results holds of a program that is not installed now."""
    if not results.is_file():
        return {}
    known = json.loads(results.read_text(encoding="utf-8")).get(part, {})
    return {key: value for key, value in known.items() if key.startswith(name)}
