"""Files of command stacks: the commands of `torquer ground send --file`, and how they follow.

stop_on = "refused"        # hold where a command is not executed; "never": go on
[[commands]]
comment = "Wheels first."  # a line by itself, or beside a command
[[commands]]
command = "set_mode"
values = { region = "stabilisation", state = "science" }
wait_for = "executed"      # what must have become of it before the next one goes
pause_s = 10               # and then so long
"""

from __future__ import annotations

import os
from pathlib import Path
from threading import Lock
from typing import Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.computer.names import Names
from torquer.flight.packets.commands import Sent, command_numbers
from torquer.flight.packets.dictionary import Dictionary, Name
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.commands import execution_time_s, has_answers
from torquer.scenario.toml_text import parse_toml

#: Most steps of a stack, bytes of its text, stacks that are saved for a satellite.
MOST_STEPS, MOST_BYTES, MOST_SAVED = 500, 262_144, 200
#: More mistakes in a stack are not listed.
_MOST_LISTED = 20


class Step(Sent):
    """A line of a stack: a command, a comment, or both."""

    at_s: float = Field(default=0.0, ge=0.0)
    """Time after the stack began to run before which it is not sent."""
    command: str = ""
    """Name of a packet of the uplink; left out: a comment only."""
    wait_for: Literal["executed", "received", "none"] | None = None
    """What must have become of it before the next one goes [executed; of one that is delayed:
    received; of one that asks for no answer: none].
    """
    pause_s: float = Field(default=0.0, ge=0.0, le=86_400.0)
    """Pause before the next one."""
    comment: str = Field(default="", max_length=300)
    """What people should know of it."""

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if not self.command and not self.comment:
            raise ValueError("command: must be given, or comment; received neither")
        return self


class StackFile(Spec):
    """A command stack."""

    stop_on: Literal["refused", "never"] = "refused"
    """When the run is held: after a command that was refused, cancelled or not answered, or never.
    """
    commands: tuple[Step, ...] = Field(min_length=1)
    """Its steps, in order."""


def read_stack(text: str) -> StackFile:
    """The stack of a TOML text; `ScenarioError` with one line for each mistake."""
    if len(text) > MOST_BYTES or not _is_utf8(text):
        raise ScenarioError(
            f"stack: must be text of at most {MOST_BYTES} characters; received {len(text)}"
        )
    stack = validate_tables(StackFile, parse_toml(text, "stack"))
    if len(stack.commands) > MOST_STEPS:
        raise ScenarioError(
            f"commands: must be at most {MOST_STEPS}; received {len(stack.commands)}"
        )
    return stack


def check_stack(
    stack: StackFile, dictionary: Dictionary, names: Names, clock_ms: int | None
) -> StackFile:
    """The stack with `wait_for` filled in; `ScenarioError` with a line for each step that is wrong.

    `clock_ms`: the satellite's clock, None if no telemetry has shown it.
    """
    answers, mistakes, steps = has_answers(dictionary), [], []
    for i, step in enumerate(stack.commands):
        try:
            steps.append(_checked(step, f"commands[{i}].", dictionary, names, answers))
            _check_at(step, f"commands[{i}].", clock_ms)
        except ScenarioError as error:
            mistakes.append(str(error))
    if mistakes:
        more = len(mistakes) - _MOST_LISTED
        last = [f"commands: {more} more are wrong"] if more > 0 else []
        raise ScenarioError("\n".join(mistakes[:_MOST_LISTED] + last))
    return stack.model_copy(update={"commands": tuple(steps)})


def _checked(step: Step, place: str, dictionary: Dictionary, names: Names, answers: bool) -> Step:
    if not step.command:
        return step.model_copy(update={"wait_for": "none"})
    command_numbers(step, dictionary, names, place)
    is_answered = answers and step.acknowledge
    if step.wait_for in ("executed", "received") and not is_answered:
        why = "asks for no answer" if answers else "goes to a satellite that does not answer"
        raise ScenarioError(
            f"{place}wait_for: must be none, as the command {why}; received {step.wait_for}"
        )
    is_delayed = step.at is not None or step.delay_s is not None
    usual = "none" if not is_answered else "received" if is_delayed else "executed"
    return step.model_copy(update={"wait_for": step.wait_for or usual})


def _check_at(step: Step, place: str, clock_ms: int | None) -> None:
    """A delay counts from the sending: only a time can be too late already."""
    if step.at is not None:
        try:
            execution_time_s(step, clock_ms)
        except ScenarioError as error:
            raise ScenarioError(f"{place}{error}") from None


class SavedStacks:
    """Stacks of a satellite that are kept in a folder, a TOML file each, by their names."""

    def __init__(self, folder: Path):
        self._folder, self._saving = folder, Lock()

    def names(self) -> list[str]:
        """The names of all, sorted."""
        return sorted(path.stem for path in self._folder.glob("*.toml") if _is_name(path.stem))

    def text(self, name: str) -> str:
        """The text of one; `ScenarioError` for a name that none has."""
        path = self._path(name)
        try:
            return path.read_text(encoding="utf-8")
        except FileNotFoundError:
            raise self._unknown(name) from None
        except (OSError, ValueError) as error:
            raise ScenarioError(f"name: must be a stack that can be read; {error}") from None

    def save(self, name: str, text: str) -> None:
        """Keep a text under a name, in place of one that has it."""
        path = self._path(name)
        with self._saving:  # of two at once neither writes into the file of the other
            if len(self.names()) >= MOST_SAVED and not path.exists():
                raise ScenarioError(f"name: must be one of those that are saved: {MOST_SAVED} are")
            part = path.with_suffix(".part")
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                part.write_text(text, encoding="utf-8")
                os.replace(part, path)
            except (OSError, ValueError) as error:
                raise ScenarioError(f"name: must be a stack that can be written; {error}") from None

    def delete(self, name: str) -> None:
        """Forget one; `ScenarioError` for a name that none has."""
        try:
            self._path(name).unlink()
        except FileNotFoundError:
            raise self._unknown(name) from None
        except OSError as error:
            raise ScenarioError(f"name: must be a stack that can be deleted; {error}") from None

    def _path(self, name: str) -> Path:
        return self._folder / f"{checked_name(name)}.toml"

    def _unknown(self, name: str) -> ScenarioError:
        known = self.names()
        must = f"one of {', '.join(known)}" if known else "that of a saved stack, and none is saved"
        return ScenarioError(f"name: must be {must}; received {name}")


def checked_name(name) -> str:
    """A name of a stack; `ScenarioError` for anything else."""
    if not _is_name(name):
        raise ScenarioError(
            "name: must be words of lower-case letters and digits, with '_' between them, at most "
            f"60 characters; received {quote_value(name)}"
        )
    return name


def _is_utf8(text: str) -> bool:
    """Whether a text can be stored: JSON may hold halves of characters."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _is_name(name) -> bool:
    try:
        return len(TypeAdapter(Name).validate_python(name)) <= 60
    except ValidationError:
        return False
