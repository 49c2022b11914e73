"""Data as JSON that every reader takes."""

import json
import math


def json_text(data, indent: int | None = 2) -> str:
    """Data as strict JSON: a number that is not finite is null."""
    return json.dumps(_finite(data), indent=indent, allow_nan=False)


def finite_or_none(value) -> float | None:
    """A number of plain data; None if it is infinite or missing."""
    return float(value) if math.isfinite(value) else None


def _finite(value):
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
