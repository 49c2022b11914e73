"""Alarms and violations of limits in a line each."""

from datetime import UTC, datetime

_STATES = {
    "active": "not acknowledged",
    "acknowledged": "acknowledged",
    "returned": "in order again, not acknowledged",
    "latched": "in order again, to be cleared, acknowledged",
    "settling": "in order again, acknowledged",
}


def alarm_in_words(alarm: dict) -> str:
    """An alarm, or a shelf alone, as `read_alarms` has it."""
    shelf = alarm.get("shelf")
    shelved = "" if shelf is None else (
        f"; shelved until {_iso(shelf['until_ms'])} by {shelf['by']}: {shelf['reason']}"
    )  # fmt: skip
    if "state" not in alarm:
        return f"{'':8}{alarm['key']}{shelved}"
    state = f"{_STATES[alarm['state']]}{_by(alarm)}"
    return (
        f"{alarm['severity']:8}{alarm['key']} {_limit(alarm)}, now {_value(alarm['value'])}, since "
        f"{_iso(alarm['since_ms'])}, {alarm['count']} x, {state}{shelved}"
    )


def violation_in_words(one: dict) -> str:
    """A violation as `read_alarms` has it."""
    seen = "" if one["acknowledged_ms"] is None else f", acknowledged{_by(one)}"
    end = _iso(one["end_ms"]) if one["is_over"] else "now"
    return (
        f"{one['severity']:8}{one['key']} {_limit(one)}, {_value(one['extreme'])} at most, "
        f"{_iso(one['start_ms'])} to {end}, {one['count']} x{seen}"
    )


def _limit(one: dict) -> str:
    return f"{one['limit']} ({one['mode']})" if one["mode"] else one["limit"]


def _value(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.7g}"


def _by(one: dict) -> str:
    if one["acknowledged_ms"] is None:
        return ""
    comment = f": {one['comment']}" if one["comment"] else ""
    return f" by {one['acknowledged_by']} {_iso(one['acknowledged_ms'])}{comment}"


def _iso(time_ms: int) -> str:
    try:
        return f"{datetime.fromtimestamp(time_ms * 1e-3, UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (ValueError, OverflowError, OSError):
        return f"{time_ms} ms since 1970"
