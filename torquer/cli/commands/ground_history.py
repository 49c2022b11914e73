"""`torquer ground at` and `torquer ground gaps`: what an archive knew, and what it lacks."""

from pathlib import Path
from typing import Literal

from torquer.base.dates import iso_ms
from torquer.base.strict_json import INFINITIES, json_text
from torquer.cli.loading import FOLDER, archive_in, date_ms, load_given, note_what_waits, span_ms
from torquer.cli.options import Json, options
from torquer.cli.output import harmless, print_note
from torquer.cli.process import FAILED_CODE

#: Most gaps that one call orders.
_MOST_ORDERS = 20
_QUALITIES = ("suspect", "unchecked", "authentic")


@options
class AtOptions:
    """Options of `torquer ground at`."""

    satellite: str | None = None
    """Short name of the satellite, where the folder has several archives."""
    by: Literal["time", "received"] = "time"
    """Which time TIME is: on-board time, or that of reception: only what had been received then."""
    scenario: Path | None = None
    """Its scenario: names of the states of its mode table [none: numbers only]."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


def at(time: str, /, *, how: AtOptions = AtOptions()) -> int:
    """Print what was known at TIME, ISO 8601 with a zone: the last row of each packet until then.

    With its age; what is older than three times its usual period, and than 10 s, is stale.
    """
    from contextlib import closing

    from torquer.computer.names import Names
    from torquer.ground.archive import dictionary_in, read_only
    from torquer.ground.past import last_known, state_in_words

    at_ms = date_ms("TIME", time)
    assert at_ms is not None
    names = Names({}, (), {}, {}, ())
    if (scenario := load_given(how.scenario)) is not None:
        from torquer.computer.computer import Blocks
        from torquer.simulation.outside.directed import computer_names

        names = computer_names(scenario, Blocks({}, {}))  # states alone: no code is executed
    path = archive_in(how.folder, how.satellite)
    with closing(read_only(path)) as db:
        dictionary = dictionary_in(db)
        known = last_known(db, dictionary, at_ms, how.by)
    state = state_in_words(known, dictionary, names)
    if how.json:
        found = {"time": at_ms, "by": how.by, "state": state, "packets": known}
        print(json_text(found, 2, INFINITIES))
    else:
        clock = "on-board time" if how.by == "time" else "time of reception"
        print(f"{path.stem} at {iso_ms(at_ms)}, {clock}")
        for name, text in state.items():
            print(harmless(f"{name}: {text}"))
        for each in known:
            _show_packet(each, dictionary.down[each["packet"]])
    if not known:
        print_note("nothing had come by then")
    note_what_waits(path)
    return 0


def _show_packet(known: dict, packet) -> None:
    from torquer.ground.past import in_words

    received = known["received_ms"]
    came = "from a recording" if received is None else f"received {iso_ms(received)}"
    stale = ", STALE" if known["stale"] else ""
    age = f"{known['age_ms'] / 1e3:.1f} s old{stale}"
    quality = _QUALITIES[known["quality"]]
    print(
        harmless(f"\n{packet.name}: {iso_ms(known['time_ms'])} on board, {came}, {quality}, {age}")
    )
    for name, field, _ in packet.numbers():
        unit = f" {field.unit}" if field.unit else ""
        print(harmless(f"  {name} = {in_words(field, known['values'][name])}{unit}"))


@options
class GapsOptions:
    """Options of `torquer ground gaps`."""

    satellite: str | None = None
    """Short name of the satellite, where the folder has several archives."""
    packet: list[str] | None = None
    """Only this packet; may be repeated [all that come in a period]."""
    start: str | None = None
    """First on-board time, ISO 8601 with a zone [a week before the last row]."""
    end: str | None = None
    """Last on-board time, ISO 8601 with a zone [all]."""
    fill: bool = False
    """Have the satellite send what it stored of the gaps in `extended`, by the ground that runs."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


def gaps(*, how: GapsOptions = GapsOptions()) -> int:
    """List where telemetry is missing: rows farther apart than the packet's usual period.

    With --fill the ground that runs in --folder orders the satellite's record of each gap in the
    packet `extended` of which nothing has come, the latest 20; the rows are packets `stored`.
    Exit code 1 unless all orders were executed.
    """
    from contextlib import closing

    from torquer.ground.archive import dictionary_in, read_only
    from torquer.ground.gaps import can_fill, find_gaps

    path = archive_in(how.folder, how.satellite)
    with closing(read_only(path)) as db:
        dictionary = dictionary_in(db)
        for name in how.packet or ():
            if name not in dictionary.down:
                raise ValueError(
                    f"--packet: must be one of {', '.join(dictionary.down)}; received {name}"
                )
        found = find_gaps(db, dictionary, how.packet, *span_ms(how.start, how.end))
    if how.fill and not can_fill(dictionary):
        raise ValueError("--fill: must be of a satellite with a record; its dictionary has none")
    sent = _fill(path.stem, how.folder, found) if how.fill else []
    if how.json:
        print(json_text({"gaps": [gap._asdict() for gap in found], "sent": sent}))
    else:
        for gap in found:
            print(_gap_line(gap))
        for each in sent:
            reason = f" ({each['reason']})" if each["reason"] else ""
            print(harmless(f"{each['id']} {each['command']}: {each['state']}{reason}"))
    if not found:
        print_note("there are no gaps")
    note_what_waits(path)
    return 0 if all(each["state"] == "executed" for each in sent) else FAILED_CODE


def _gap_line(gap) -> str:
    most, why = ("at most ", ", as the clock went back") if gap.went_back else ("", "")
    return (
        f"{gap.packet}: {iso_ms(gap.start_ms)} to {iso_ms(gap.end_ms)}: {most}{gap.missing} rows "
        f"of one each {gap.every_ms / 1e3:g} s are missing{why}; {gap.stored} stored ones came"
    )


def _fill(satellite: str, folder: Path, found: list) -> list[dict]:
    """Order what is stored of gaps, one after the other: the satellite sends one at a time."""
    from torquer.ground.client import RunningGround
    from torquer.ground.gaps import MAIN, fill, is_on_board

    ground = RunningGround(folder)
    wanted = [gap for gap in found if gap.packet == MAIN and not gap.stored]
    spans = [(gap.start_ms, gap.end_ms) for gap in wanted if is_on_board(gap.start_ms, gap.end_ms)]
    orders = [fill(*span).model_dump(exclude_none=True) for span in spans[-_MOST_ORDERS:]]
    return [each for order in orders for each in ground.send([order], satellite)]
