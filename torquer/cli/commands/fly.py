"""`torquer fly`, `torquer session`: the flight software flown, recorded, flown again."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, nullcontext
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from torquer.base.folder_lock import claim
from torquer.base.limits import at_least, positive
from torquer.base.strict_json import json_text
from torquer.cli.compiling import show_progress
from torquer.cli.loading import (
    check_computer,
    check_files,
    check_software,
    find_code,
    load_checked,
)
from torquer.cli.options import CodeOptions, Json, as_options, options
from torquer.cli.output import (
    make_writable,
    print_error,
    print_note,
    say,
    writing_to,
)
from torquer.cli.process import FAILED_CODE, SIGNAL_CODE, leave_or_raise
from torquer.flight.link import Link, open_link, screens_of
from torquer.flight.packets.bits import values_in_words
from torquer.flight.packets.commands import load_script, make_frames
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.reasons import describe_code
from torquer.flight.packets.received import Downlink, as_tables
from torquer.flight.packets.software_file import code_in
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.flight.software.faults import (
    FaultsFile,
    check_faults,
    load_faults,
    software_faults,
    with_device_faults,
)
from torquer.flight.software.memory import Memory
from torquer.flight.software.session import (
    Lateness,
    Sender,
    Tick,
    first_difference,
    fly_steps,
    read_scenario,
    replay_session,
)
from torquer.flight.software.session_file import (
    Recorder,
    Replayed,
    Session,
    begin_session,
    load_session,
)
from torquer.flight.software.software import Software, load_software
from torquer.simulation.results.file import put
from torquer.simulation.setup.signals import ALL, Stop, noting_signals
from torquer.simulation.setup.simulate import RunStopped

#: Kinds of events that are printed.
_SHOWN = 12


class _Flight(NamedTuple):
    """A flight ready to begin; `memory`: the files of its non-volatile memory before it; `link`:
    to a ground outside, if there is one.
    """

    core: Core
    sender: Sender
    faults: FaultsFile
    software: Software
    memory: dict
    link: Link | None
    lateness: Lateness


@options
class FlyOptions:
    """Options of `torquer fly`."""

    software: Path | None = None
    """File of the flight software [that of Chibis-M]."""
    commands: Path | None = None
    """File of commands with the times at which they are sent."""
    faults: Path | None = None
    """File of faults and reboots."""
    computer: Path | None = None
    """Fly the computer in C that `export c` wrote in this folder, or a library built from it."""
    memory: Path | None = None
    """Folder of the non-volatile memory, kept after the flight [in memory, as delivered]."""
    speed: Annotated[float | None, positive()] = None
    """How many times real time at most [as fast as it goes]."""
    realtime: bool = False
    """Fly in real time."""
    listen: str | None = None
    """Link to the ground: tcp:HOST:PORT, udp:HOST:PORT, can:virtual:CHANNEL,
    can:udp_multicast:GROUP or can:socketcan:INTERFACE [none]; with --realtime or --speed."""
    ticks: Annotated[int | None, at_least(1)] = None
    """Number of control steps [to the end of SCENARIO]."""
    out: Path | None = None
    """Output folder [runs/NAME-flight]."""
    json: Json = False


def fly(
    scenario: Path, *, how: FlyOptions = FlyOptions(), code: CodeOptions = CodeOptions()
) -> int:
    """Fly SCENARIO with flight software around its on-board computer: modules, queues, packets.

    In lock-step, as fast as it goes. Writes the session (session.json) and what comes down
    (downlink.bin) as it runs, then a table for each packet and a picture of them. The session can
    be flown again to the same bytes, that of a flight that was killed as far as it came.
    """
    if how.realtime and how.speed is not None:
        raise ValueError("--speed: must not be given with --realtime; received both")
    if how.listen and not how.realtime and how.speed is None:
        raise ValueError("--listen: must be given with --realtime or --speed; received neither")
    if how.listen and how.commands:
        raise ValueError(
            "--commands: must not be given with --listen, whose ground counts the commands; "
            "received both (`torquer ground send --file` sends a file)"
        )
    check_computer(how.computer, code)
    loaded = load_checked(scenario, code)
    check_software(how.software, code)
    faults = load_faults(how.faults) if how.faults else FaultsFile()
    flown = with_device_faults(loaded, faults)
    out = how.out or Path("runs") / f"{flown.name}-flight"
    make_writable(out)
    # the folder is free again before a late signal ends the process
    with (
        noting_signals(ALL, (leave_or_raise,)) as signals,
        writing_to(out),
        claim(out),
        _claim_memory(how.memory),
    ):
        flight = _prepare(flown, faults, how)
        beginning = begin_session(flown, faults, how.software, flight.memory)
        begun_s = time.process_time()
        with (
            closing(flight.link) if flight.link else nullcontext(),
            Recorder(out / "session.json", beginning) as recorder,
            Downlink(out / "downlink.bin") as downlink,
        ):
            stopped = _fly(flight, flown, how, recorder, downlink, signals)
        took_s = time.process_time() - begun_s
        number = signals.number if signals.asked else 0
        signals.forget()  # what came down until then is written
        tables = as_tables(downlink.frames(Station(flight.software)))
        files = _write(flight, tables, flown.name, out)
    _show(flight, recorder, tables, out, files, took_s, how)
    if stopped:
        print_error(f"{stopped}; what came down until then is in {out}")
    for note in _notes(flight, recorder, how, bool(stopped)):
        print_note(note)
    return SIGNAL_CODE + number if number else FAILED_CODE if stopped else 0


def _claim_memory(folder: Path | None):
    """The folder of the non-volatile memory, whose counters no other flight may use."""
    if folder is None:
        return nullcontext()
    make_writable(folder, "--memory")
    return claim(folder, "--memory")


def _notes(flight: _Flight, recorder: Recorder, how: FlyOptions, is_stopped: bool) -> Iterator[str]:
    """Exceptions of modules; what did not happen because the flight ended before it."""
    for module, exception in flight.core.exceptions.items():
        yield f"module {module} raised {exception}"
    if is_stopped:
        return
    if how.ticks is not None and recorder.ticks < how.ticks:
        yield f"--ticks: the scenario ends after {recorder.ticks} control steps"
    last, end_s = recorder.ticks - 1, flight.core.services.t_s
    late = [
        fault
        for fault in software_faults(flight.faults)
        if (fault.at_s or 0.0) > end_s or (fault.tick or 0) > last
    ]
    for number, what in ((flight.sender.waiting, "commands"), (len(late), "faults")):
        if number:
            yield f"--{what}: {number} of the file come after the end of the flight"


def _write(flight: _Flight, tables: dict, name: str, out: Path) -> str:
    """Write tables and picture; the names of all files, for the user."""
    from torquer.simulation.results.netcdf import write_bytes

    for packet in flight.software.dictionary.down:  # of an earlier flight
        (out / f"{packet}.nc").unlink(missing_ok=True)
    (out / "downlink.png").unlink(missing_ok=True)
    for packet, table in tables.items():
        put(out / f"{packet}.nc", write_bytes(table))
    if "extended" not in tables:
        return "session.json, downlink.bin" + ", a table for each packet" * bool(tables)
    from torquer.report.downlink import draw_downlink

    draw_downlink(tables, name, out / "downlink.png")
    return "session.json, downlink.bin, downlink.png, a table for each packet"


def _prepare(scenario, faults: FaultsFile, how: FlyOptions) -> _Flight:
    software = load_software(how.software)
    memory = Memory(how.memory)
    if memory.counts:
        raise ValueError(
            "--memory: must be a folder in which main/ and reserve/ can be made; received "
            f"{how.memory}"
        )
    before = memory.snapshot()["files"]
    check_faults(faults, software.modules)
    core = _make_core(scenario, software, memory, how.computer)
    software = core.software  # its packets name the sensors of this satellite
    frames = []
    if how.commands:
        script = load_script(how.commands)
        frames = make_frames(script, software.dictionary, core.flight.names, scenario.start)
    if software.link != "historical" and software.keys.are_known:
        print_note(
            "the link is protected by keys that everybody knows; up_key and down_key of the "
            "software file name your own"
        )
    sender, link = Sender(frames, Station(software)), _listen(how.listen, core)
    return _Flight(core, sender, faults, software, before, link, Lateness())


def _make_core(scenario, software: Software, memory: Memory, computer: Path | None) -> Core:
    """The satellite with its flight software, around the computer in C if there is one."""
    try:
        core = Core(scenario, software, memory, computer)
    except ValueError as error:
        raise ValueError(as_options(str(error), {"computer": "--computer"})) from None
    if core.flight.is_single:
        print_note(
            "the session is flown again in double precision: `torquer session` finds other bytes "
            "than those of this computer in single precision"
        )
    return core


def _listen(address: str | None, core: Core) -> Link | None:
    """The link to the ground, if there is to be one."""
    if address is None:
        return None
    try:
        screens = screens_of(core.software, core.judge)
        link = open_link(address, core.software.dictionary, screens)
    except ValueError as error:
        raise ValueError(f"--listen: {error}") from None
    print_note(f"listening on {link.address}")
    return link


def _fly(
    flight: _Flight, scenario, how, recorder: Recorder, downlink: Downlink, signals: Stop
) -> str:
    """Fly to the end; what stopped the flight before, or ""."""
    link, whole = flight.link, scenario.simulation.duration_s
    ticks = fly_steps(
        flight.core,
        lambda tick, t_s: flight.sender.at(t_s) + (link.receive() if link else b""),
        software_faults(flight.faults),
        how.ticks,
        1.0 if how.realtime else how.speed,
    )
    with show_progress(scenario.name) as progress:
        try:
            for tick in ticks:
                recorder.note(tick.downlink, tick.uplink)
                downlink.take(tick.t_s, tick.downlink)
                flight.lateness.take(tick.late_s)
                if link:
                    link.send(tick.downlink)
                if signals.asked:
                    return f"interrupted after {recorder.ticks} control steps"
                if progress and tick.number % 64 == 0:
                    progress(tick.t_s / whole)
        except RunStopped as error:
            return str(error)
    return ""


def _show(
    flight: _Flight,
    recorder: Recorder,
    tables: dict,
    out: Path,
    files: str,
    took_s: float,
    how: FlyOptions,
) -> None:
    core = flight.core
    count = Counter({name: table.sizes["frame"] for name, table in tables.items()})
    data: dict[str, Any] = {
        "ticks": recorder.ticks,
        "flown_s": core.services.t_s,
        "modes": core.flight.modes(),
        "reboots": core.services.reboots,
        "downlink_bytes": recorder.downlink_bytes,
        "digest": recorder.digest(),
        "packets": dict(count),
        "events": _events(flight.software.dictionary, tables.get("event")),
        "times_real_time": round(core.services.t_s / max(took_s, 1e-9)),
        "out": str(out),
    }
    if how.realtime or how.speed is not None:
        data["late_ms"] = flight.lateness.summary()
    if flight.link:
        data["link"] = {"address": flight.link.address, **flight.link.counts()}
    if how.json:
        print(json_text(data))
        return
    say(f"{recorder.ticks} control steps, {core.services.t_s:g} s of flight")
    say("modes: " + ", ".join(f"{region} {state}" for region, state in data["modes"].items()))
    say("packets: " + ", ".join(f"{name} {n}" for name, n in count.most_common()))
    for event, number in Counter(each["event"] for each in data["events"]).most_common(_SHOWN):
        say(f"event: {event}" + (f" ({number} times)" if number > 1 else ""))
    say(f"reboots: {data['reboots']}; {recorder.downlink_bytes} bytes came down")
    if "late_ms" in data:
        late = ", ".join(f"{name} {value:g} ms" for name, value in data["late_ms"].items())
        say(f"lateness of control steps: {late}")
    if flight.link:
        say("link: " + ", ".join(f"{name} {n}" for name, n in data["link"].items()))
    say(f"written to {out}: {files}")


def _events(dictionary: Dictionary, table) -> list[dict]:
    """Entries of the error log that came down."""
    if table is None:
        return []
    modules = {number: name for name, number in dictionary.modules.items()}
    names = ("received_s", *dictionary.down["event"].names[:3])
    columns = [table[name].values.tolist() for name in names]
    return [
        {
            "received_s": at_s,
            "event": f"{modules.get(module, module)}: {describe_code(code)}",
            "argument": argument,
        }
        for at_s, module, code, argument in zip(*columns, strict=True)
    ]


def _load_session(path: Path, code: CodeOptions) -> Session:
    """A session whose Python files may be executed; they are named by whoever recorded it."""
    session = load_session(path)
    named = find_code(read_scenario(session))
    if session.software:
        named |= code_in(Path(session.software))
    check_files(named, path, "session's", code)
    return session


def replay(session: Path, *, code: CodeOptions = CodeOptions(), json: Json = False) -> int:
    """Fly SESSION again; exit code 1 unless the same bytes come down."""
    recorded, recorder = _load_session(session, code), Replayed()
    if not recorded.digests:
        raise ValueError(f"SESSION: must hold a digest to be compared with; received {session}")
    with show_progress(session.stem) as progress:
        for tick in replay_session(recorded):
            recorder.note(tick.downlink)
            if progress and tick.number % 64 == 0:
                progress(tick.number / max(recorded.ticks, 1))
    same = recorder.list_digests() == recorded.digests
    same = same and recorder.downlink_bytes == recorded.downlink_bytes
    if json:
        print(json_text({"same": same, "ticks": recorder.ticks, "digest": recorder.digest()}))
    elif same:
        say(f"the same bytes: {recorder.downlink_bytes} in {recorder.ticks} control steps")
    else:
        print_error(f"other bytes than recorded, from control step {recorder.parted(recorded)} on")
    return 0 if same else FAILED_CODE


def bisect(
    first: Path, second: Path, *, code: CodeOptions = CodeOptions(), json: Json = False
) -> int:
    """Find the first control step at which the downlinks of two sessions differ.

    Exit code 1 if there is one.
    """
    a, b = (_load_session(each, code) for each in (first, second))
    found = first_difference(a, b)
    if found is None:
        if json:
            print(json_text({"same": True}))
        else:
            say("the same bytes came down")
        return 0
    tick = next(each for each in found if each is not None)
    sides = {str(first): _packets(found.first, a), str(second): _packets(found.second, b)}
    if json:
        print(json_text({"same": False, "tick": tick.number, "t_s": tick.t_s, "packets": sides}))
        return FAILED_CODE
    say(f"the first difference is at control step {tick.number}, t = {tick.t_s:g} s")
    for name, packets in sides.items():
        say(f"  {name}: " + ("; ".join(packets) or "nothing"))
    return FAILED_CODE


def _packets(tick: Tick | None, session: Session) -> list[str]:
    """The packets of a control step in words."""
    if tick is None:
        return ["has ended"]
    software = load_software(Path(session.software) if session.software else None)
    station = Station(software.for_satellite(read_scenario(session)))
    frames = [*station.receive(tick.downlink), *station.finish()]
    return [f"{frame.packet.name} ({_listed(frame)})" for frame in frames]


def _listed(frame: Frame) -> str:
    return ", ".join(values_in_words(frame.packet, frame.values))
