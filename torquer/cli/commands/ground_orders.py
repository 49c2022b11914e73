"""`torquer ground stack` and `history`: sequences of commands, and what became of all."""

import time
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from torquer.base.dates import iso_ms
from torquer.base.limits import within
from torquer.base.strict_json import json_text
from torquer.cli.loading import FOLDER, archive_in, ask_or_read, span_ms
from torquer.cli.options import Json, options
from torquer.cli.output import harmless, print_note
from torquer.cli.process import FAILED_CODE
from torquer.ground.command_states import State

#: A name that is stated with commands.
As = Annotated[str | None, Parameter(name="--as")]
#: What is done with the stack of a satellite, and with those that are saved.
ON_STACK = ("next", "skip", "hold", "abort")
_SAVED = ("text", "save", "delete")
Action = Literal[
    "show", "load", "next", "run", "hold", "skip", "abort", "list", "text", "save", "delete"
]
#: Time between two looks at a stack that runs [s].
_LOOK_S = 0.3


@options
class StackOptions:
    """Options of `torquer ground stack`."""

    satellite: str | None = None
    """Short name of the satellite, where the ground serves several."""
    name: str | None = None
    """Name under which a file is saved or loaded [that of the file]."""
    operator: As = None
    """Your name, stated with what you order; nothing proves it."""
    no_wait: bool = False
    """Of `run`: do not wait until the stack is over or held."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    json: Json = False


def stack(
    action: Action = "show", what: str | None = None, /, *, how: StackOptions = StackOptions()
) -> int:
    """Load a stack of commands, and send it step by step, by the ground that runs in --folder.

    ACTION is one of: `show`; `load` WHAT, a file that ends in .toml or the name of a saved stack,
    checked as a whole; `next` (send one step), `run` (with its pauses), `hold`, `skip`, `abort`.
    Others are `list` the saved stacks, `text` or `delete` the one with the name WHAT, `save` the
    file WHAT. Page and command line see the same stack. `run` waits; exit code 1 unless all steps
    of the stack went well.
    """
    from torquer.ground.client import RunningGround

    needs_what = action == "load" or action in _SAVED
    if needs_what != (what is not None):
        must = "must be given" if needs_what else "must be left out"
        raise ValueError(f"WHAT: {must} with {action}; received {what or 'nothing'}")
    ground = RunningGround(how.folder, how.operator)
    if action in ON_STACK or action == "run":
        ground.act_on_stack(action, how.satellite)
        if action == "run" and not how.no_wait:
            _wait(ground, how)
    elif what is not None:
        _on_file(ground, action, what, how)
    if action in _SAVED:
        return 0
    found = ground.stack(how.satellite)
    if how.json:
        print(json_text(found))
    elif action == "list":
        print(*found["saved"], sep="\n", end="\n" if found["saved"] else "")
    else:
        _show(found["stack"])
    return FAILED_CODE if action == "run" and not _went_well(found["stack"], how.no_wait) else 0


def _on_file(ground, action: str, what: str, how: StackOptions) -> None:
    """Load, save, show or delete a stack that is in a file here, or saved on the ground."""
    from torquer.scenario.toml_text import read_text

    if action == "text":
        print(ground.saved_stack(what, how.satellite), end="")
    elif action == "delete":
        ground.delete_stack(what, how.satellite)
    elif action == "load" and not what.endswith(".toml"):
        ground.load_stack(None, what, how.satellite)
    else:
        path = Path(what)
        text, name = read_text(path, "stack"), how.name or path.stem.lower().replace("-", "_")
        if action == "save":
            ground.save_stack(name, text, how.satellite)
        else:
            ground.load_stack(text, name, how.satellite)


def _wait(ground, how: StackOptions) -> None:
    """Wait while the stack runs."""
    while ground.stack(how.satellite)["stack"]["state"] == "running":
        time.sleep(_LOOK_S)


def _went_well(stack: dict, no_wait: bool) -> bool:
    is_going = no_wait and stack["state"] == "running"
    ended = stack["state"] == "over"
    return is_going or (ended and all(each["state"] != "failed" for each in stack["steps"]))


def _show(stack: dict | None) -> None:
    if stack is None:
        print_note("no stack was loaded")
        return
    reason = f" ({stack['reason']})" if stack["reason"] else ""
    print(harmless(f"stack {stack['name'] or stack['id']}: {stack['state']}{reason}"))
    for step in stack["steps"]:
        print(harmless(f"{'>' if step['place'] == stack['next'] else ' '} {_step_in_words(step)}"))


def _step_in_words(step: dict) -> str:
    comment = f"# {step['comment']}" if step.get("comment") else ""
    command = in_words(step) if step["command"] else ""
    number = f", command {step['id']} {step['became']}" if step["id"] else ""
    reason = f" ({step['reason']})" if step["reason"] else ""
    parts = filter(None, (str(step["place"]), command, comment))
    return f"{' '.join(parts)}: {step['state']}{number}{reason}"


def in_words(command: dict) -> str:
    """A command with its values."""
    values = "".join(f" {key}={value}" for key, value in (command["values"] or {}).items())
    return f"{command['command']}{values}"


@options
class HistoryOptions:
    """Options of `torquer ground history`."""

    satellite: str | None = None
    """Short name of the satellite, where the folder has archives of several."""
    command: str = ""
    """Only commands with this in their names."""
    state: State | None = None
    """Only those of which this became."""
    by: str = ""
    """Only those ordered by somebody with this in the name, as stated."""
    start: str | None = None
    """Made from this time on, ISO 8601 with a zone [all]."""
    end: str | None = None
    """Made up to this time, ISO 8601 with a zone [all]."""
    size: Annotated[int | None, within(1, 20_000)] = 100
    """How many at most: the last ones."""
    folder: Path = FOLDER
    """Folder of the ground's archives."""
    csv: bool = False
    """Print them as CSV."""
    json: Json = False


def history(*, how: HistoryOptions = HistoryOptions()) -> int:
    """List commands with who made them, when, and what became of each, oldest first.

    They are asked of the ground that runs in --folder, which also knows those that a full disk does
    not take; without one they are read from the archive.
    """
    from torquer.ground.command_history import Wanted, commands_csv

    if how.csv and how.json:
        raise ValueError("--csv: must not be given with --json; received both")
    span = dict(zip(("start", "end"), span_ms(how.start, how.end), strict=True))
    wanted = Wanted(
        command=how.command,
        state=how.state,
        by=how.by,
        size=how.size or 1,
        **{key: value for key, value in span.items() if value is not None},
    )
    found = _find(archive_in(how.folder, how.satellite), wanted)[::-1]
    if how.json:
        print(json_text(found))
    elif how.csv:
        print(commands_csv(found), end="")
    else:
        for each in found:
            reason = f" ({each['reason']})" if each["reason"] else ""
            when = f"{each['id']} {iso_ms(each['made_ms'])}"
            print(harmless(f"{when} {in_words(each)}: {each['state']}{reason}, {each['made_by']}"))
        if not found:
            print_note("there are no such commands")
    return 0


def _find(archive: Path, wanted) -> list[dict]:
    """Commands by the ground that writes an archive, else by the archive, newest first."""
    from contextlib import closing

    from torquer.ground.archive import read_only
    from torquer.ground.command_history import find_commands

    def ask(ground, satellite: str) -> list[dict]:
        return ground.history(satellite, **wanted.model_dump(exclude_none=True))

    def read(path: Path) -> list[dict]:
        with closing(read_only(path)) as db:
            return find_commands(db, wanted)

    return ask_or_read(archive, ask, read)
