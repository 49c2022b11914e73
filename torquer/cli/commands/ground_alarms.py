"""`torquer ground alarms`: the alarms of a satellite, and the out-of-limits log."""

from pathlib import Path
from typing import Annotated

from torquer.base.dates import iso_s
from torquer.base.limits import within
from torquer.base.strict_json import INFINITIES, json_text
from torquer.cli.loading import FOLDER, archive_in, ask_or_read, span_ms
from torquer.cli.options import Json, options
from torquer.cli.output import harmless, print_note

_STATES = {
    "active": "not acknowledged",
    "acknowledged": "acknowledged",
    "returned": "in order again, not acknowledged",
    "latched": "in order again, to be cleared, acknowledged",
    "settling": "in order again, acknowledged",
}


@options
class AlarmsOptions:
    """Options of `torquer ground alarms`."""

    satellite: str | None = None
    """Short name of the satellite, where the folder has archives of several."""
    log: bool = False
    """List the out-of-limits log as well, the newest first."""
    start: str | None = None
    """First on-board time of the log, ISO 8601 with a zone [all]."""
    end: str | None = None
    """Last on-board time of the log, ISO 8601 with a zone [all]."""
    size: Annotated[int, within(1, 20_000)] = 100
    """Most entries of the log."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


def alarms(*, how: AlarmsOptions = AlarmsOptions()) -> int:
    """List the alarms of a satellite, and the out-of-limits log.

    They are asked of the ground that runs in --folder, which also knows those that a full disk does
    not take; without one they are read from the archive. Times are of the satellite's clock unless
    they are of operators.
    """
    span = dict(zip(("start_ms", "end_ms"), span_ms(how.start, how.end), strict=True))
    given = {key: value for key, value in span.items() if value is not None}
    if given and not how.log:
        raise ValueError(
            f"--{next(iter(given))[:-3]}: must be given with --log, whose times it is of"
        )
    found = _find(archive_in(how.folder, how.satellite), how.log, given | {"size": how.size})
    if how.json:
        violations = {"violations": found.violations} if how.log else {}
        print(json_text({"alarms": found.alarms} | violations, infinities=INFINITIES))
        return 0
    for each in found.alarms:
        print(harmless(_alarm_in_words(each)))
    if not found.alarms:
        print_note("no alarms")
    if how.log:
        print("out-of-limits log:")
        for each in found.violations:
            print(harmless(_violation_in_words(each)))
    return 0


def _find(archive: Path, log: bool, wanted: dict[str, int]):
    """Alarms, and violations where they are wanted, by the ground or by the archive."""
    from torquer.ground.violations import AlarmRecord, read_alarms

    def ask(ground, satellite: str) -> AlarmRecord:
        asked = {key.removesuffix("_ms"): value for key, value in wanted.items()}
        violations = ground.violations(satellite, **asked) if log else []
        return AlarmRecord(ground.alarms(satellite), violations)

    return ask_or_read(archive, ask, lambda path: read_alarms(path, **wanted))


def _alarm_in_words(alarm: dict) -> str:
    """An alarm, or a shelf alone, as `read_alarms` has it."""
    shelf = alarm.get("shelf")
    shelved = "" if shelf is None else (
        f"; shelved until {iso_s(shelf['until_ms'])} by {shelf['by']}: {shelf['reason']}"
    )  # fmt: skip
    if "state" not in alarm:
        return f"{'':8}{alarm['key']}{shelved}"
    state = f"{_STATES[alarm['state']]}{_by(alarm)}"
    return (
        f"{alarm['severity']:8}{alarm['key']} {_limit(alarm)}, now {_value(alarm['value'])}, since "
        f"{iso_s(alarm['since_ms'])}, {alarm['count']} x, {state}{shelved}"
    )


def _violation_in_words(one: dict) -> str:
    """A violation as `read_alarms` has it."""
    seen = "" if one["acknowledged_ms"] is None else f", acknowledged{_by(one)}"
    end = iso_s(one["end_ms"]) if one["is_over"] else "now"
    return (
        f"{one['severity']:8}{one['key']} {_limit(one)}, {_value(one['extreme'])} at most, "
        f"{iso_s(one['start_ms'])} to {end}, {one['count']} x{seen}"
    )


def _limit(one: dict) -> str:
    return f"{one['limit']} ({one['mode']})" if one["mode"] else one["limit"]


def _value(value: float | str | None) -> str:
    return "unknown" if value is None else f"{float(value):.7g}"


def _by(one: dict) -> str:
    if one["acknowledged_ms"] is None:
        return ""
    comment = f": {one['comment']}" if one["comment"] else ""
    return f" by {one['acknowledged_by']} {iso_s(one['acknowledged_ms'])}{comment}"
