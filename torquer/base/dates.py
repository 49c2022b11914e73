"""Times in ms since 1970, UTC, as people and other programs read them; never an error."""

from __future__ import annotations

from datetime import UTC, datetime


def iso_ms(time_ms: int | None) -> str:
    """A time as ISO 8601, to the millisecond; "" for none.

    Here and below, a time beyond the calendar's years is its number.
    """
    return "" if time_ms is None else _text(time_ms, "T", "milliseconds", "Z")


def iso_s(time_ms: int) -> str:
    """A time as ISO 8601, rounded down to the second."""
    return _text(time_ms, "T", "seconds", "Z")


def table_utc(time_ms: int) -> str:
    """A time rounded down to the second, for a place that says by itself that it is UTC."""
    return _text(time_ms, " ", "seconds", "")


def _text(time_ms: int, between: str, to: str, zone: str) -> str:
    try:  # of whole numbers: as a float a time may be in the millisecond before
        at = datetime.fromtimestamp(time_ms // 1000, UTC)
    except (ValueError, OverflowError, OSError):
        return f"{time_ms} ms since 1970"
    at = at.replace(microsecond=time_ms % 1000 * 1000, tzinfo=None)
    return f"{at.isoformat(between, to)}{zone}"
