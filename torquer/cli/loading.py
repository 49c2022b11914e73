"""What commands load: scenarios whose Python files may be executed, archives of a ground.

Also what the ground that runs knows, which its archive may lack.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from torquer.base.dates import iso_s
from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable, print_note

if TYPE_CHECKING:
    from torquer.campaign.spec import Campaign
    from torquer.scenario.spec import Scenario

T = TypeVar("T")
#: Where a ground has its archives unless another folder is given.
FOLDER = Path("runs/ground")
#: How long a ground is waited for that is asked for a note alone [s].
_NOTE_PATIENCE_S = 2.0


def archive_in(folder: Path, name: str | None) -> Path:
    """The archive of a satellite in a folder, or the only one; ValueError where there is none."""
    known = sorted(path.stem for path in folder.glob("*.sqlite"))
    if not known:
        raise ValueError(f"--folder: must hold an archive, NAME.sqlite; received {folder}")
    found = known[0] if name is None and len(known) == 1 else name
    if found not in known:
        raise ValueError(
            f"--satellite: must be one of {', '.join(known)}; received {name or 'nothing'}"
        )
    return folder / f"{found}.sqlite"


def date_ms(option: str, text: str | None) -> int | None:
    """Milliseconds since 1970 of a date with a zone; ValueError for anything else."""
    if text is None:
        return None
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        at = None
    if at is None or at.tzinfo is None:
        raise ValueError(
            f"{option}: must be a time with a zone, such as 2012-01-01T00:00:00Z; received {text}"
        )
    return round(at.timestamp() * 1e3)


def span_ms(start: str | None, end: str | None) -> tuple[int | None, int | None]:
    """What `--start` and `--end` say [ms since 1970]; ValueError for an end before the start."""
    start_ms, end_ms = date_ms("--start", start), date_ms("--end", end)
    if start_ms is not None and end_ms is not None and start_ms > end_ms:
        raise ValueError(f"--end: must not be before --start; received {end}")
    return start_ms, end_ms


def load_given(path: Path | None) -> Scenario | None:
    """The scenario of a file whose code is not executed; None where none is given."""
    from torquer.scenario.load import load_scenario

    return None if path is None else load_scenario(path, code=False)


def load_checked(path: Path, code: CodeOptions) -> Scenario:
    """The scenario of a file; ValueError if it names Python files that may not be executed."""
    from torquer.scenario.load import load_scenario

    scenario = load_scenario(path)
    check_code(scenario, path, code)
    return scenario


def load_usable(path: Path, code: CodeOptions, out: Path | None) -> Scenario:
    """The scenario of a file, checked for flight, with a folder for its pictures if one is given.

    ValueError for code that may not be executed, for unusable models, and for a folder that cannot
    be written.
    """
    from torquer.scenario.load import check_orbit_environment

    scenario = load_checked(path, code)
    check_orbit_environment(scenario)
    if out is not None:
        make_writable(out)
    return scenario


def note_whole_flights(scenario: Scenario) -> None:
    """Say that a condition that would end the scenario's run early ends no flight here."""
    if scenario.simulation.end_when is not None:
        print_note(
            "flights go on to their full length, whatever simulation.end_when says: what comes "
            "later is judged, too"
        )


def find_code(scenario: Scenario, campaign: Campaign | None = None) -> dict[str, Path]:
    """Python files that a run of the scenario, or any member of a campaign, executes, by key."""
    from torquer.base.user_code import own_files

    parts = own_files(scenario).items()
    named = {f"{key}.file": part.file for key, part in parts if part.executes}
    if campaign is None:
        return named
    from torquer.campaign.files import code_named

    return named | dict(code_named(campaign))


def check_code(
    scenario: Scenario, path: Path, code: CodeOptions, campaign: Campaign | None = None
) -> None:
    """ValueError for a law's file if none is allowed, or none in its place."""
    check_files(find_code(scenario, campaign), path, "scenario's", code)


def check_files(files: dict[str, Path], beside: Path, whose: str, code: CodeOptions) -> None:
    """ValueError for a Python file if none is allowed, or one outside the folder of a file."""
    folder = beside.resolve().parent
    for key, file in files.items():
        if code.no_user_code:
            raise ValueError(f"{key}: must not be given with --no-user-code; received {file}")
        if not (code.code_from_anywhere or file.resolve().is_relative_to(folder)):
            raise ValueError(
                f"{key}: must lie in the {whose} folder, or be allowed by "
                f"--code-from-anywhere; received {file}"
            )


def check_software(software: Path | None, code: CodeOptions) -> None:
    """ValueError for a software file whose modules may not be executed."""
    from torquer.flight.packets.software_file import code_in

    if software is not None:
        check_files(code_in(software), software, "software file's", code)


def check_computer(computer: Path | None, code: CodeOptions) -> None:
    """ValueError for an exported computer, which is executed, where no code is allowed."""
    if computer is not None and code.no_user_code:
        raise ValueError(
            f"--computer: must not be given with --no-user-code; received {computer}, whose C code "
            "is executed"
        )


def load_result(
    path: Path, name: str, file: str = "result.nc", what: str = "folders of runs, or result.nc"
):
    """The result in a file, or in a folder that holds one; ValueError that begins with a name."""
    from torquer.simulation.results.file import load

    try:
        return load(path / file if path.is_dir() else path)
    except OSError as error:
        raise ValueError(
            f"{name}: must be {what}; received {path} ({error.strerror or error})"
        ) from None
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def open_result(path: Path, name: str):
    """As `load_result`, of a run or a campaign; numbers are read when they are asked for."""
    from torquer.simulation.results.file import lazily

    try:
        return lazily(path)
    except (OSError, ValueError) as error:
        text = str(error).removeprefix("path: ").removeprefix("result: ")
        raise ValueError(f"{name}: {text}") from None


def ask_or_read(archive: Path, ask: Callable[..., T], read: Callable[[Path], T]) -> T:
    """`ask(ground, satellite)` of the ground that writes an archive; where none does, `read` of it.

    What is read alone lacks what a disk did not take: a note says so.
    """
    from torquer.ground.client import RunningGround

    try:
        return ask(RunningGround(archive.parent), archive.stem)
    except ValueError:  # none runs, or it serves other satellites
        found = read(archive)
        print_note(f"{archive.name} alone is read: no ground that writes it answers")
        return found


def note_what_waits(archive: Path) -> None:
    """Say since when the ground that writes an archive cannot: what came since is not in it."""
    from torquer.ground.alarm import ARCHIVE_ALARM
    from torquer.ground.client import RunningGround
    from torquer.ground.limits import IN_ORDER

    with suppress(ValueError):  # none runs, or it serves other satellites
        for each in RunningGround(archive.parent, patience_s=_NOTE_PATIENCE_S).alarms(archive.stem):
            if each["key"] == ARCHIVE_ALARM and each.get("condition", IN_ORDER) != IN_ORDER:
                since = iso_s(each["since_ms"])
                print_note(f"{archive.name}: nothing is archived since {since}, and this lacks it")
