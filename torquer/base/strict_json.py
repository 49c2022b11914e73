"""Data as JSON that every reader takes."""

import json
import math
from collections.abc import Mapping

#: Infinities where they are told from what is missing: `Number` of JavaScript reads them.
INFINITIES = {math.inf: "Infinity", -math.inf: "-Infinity"}


def json_text(data, indent: int | None = 2, infinities: Mapping[float, str] = {}) -> str:
    """Data as strict JSON: a number that is not finite is null, infinities as `infinities` says."""
    return json.dumps(_finite(data, infinities), indent=indent, allow_nan=False)


def finite_or_none(value) -> float | None:
    """A number of plain data; None if it is infinite or missing."""
    return float(value) if math.isfinite(value) else None


def _finite(value, infinities: Mapping[float, str]):
    if isinstance(value, dict):
        return {key: _finite(each, infinities) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each, infinities) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return infinities.get(value)
    return value
