"""Options of the commands: each stated once, with type, range and help, as a field of a dataclass.

What a function of the package is asked is a `request` of `base.limits`; a command takes it as
`Annotated[DetumbleRequest, FLAT]`. What only the command line knows - where files go, JSON - is a
class with the decorator `options`.
"""

from typing import Annotated, Literal, TypeVar, dataclass_transform

from cyclopts import Parameter, convert

from torquer.base.limits import request

T = TypeVar("T")
Json = Annotated[bool, Parameter(help="Print machine-readable JSON.")]
Figure = Annotated[
    Literal["paper"] | None,
    Parameter(help="Draw each plot for one column of a paper, too: 88 mm, 8 pt, in paper/."),
]
#: For a dataclass whose fields are options of the command.
FLAT = Parameter(name="*")


def as_written(kind, tokens):
    """What the words of an option say; a whole number must be written as one (cyclopts would
    round 1.5 to 2)."""
    if kind in (int, int | None):
        text = tokens[0].value
        try:
            return int(text)
        except ValueError:
            raise ValueError(f"must be a whole number; received {text}") from None
    return convert(kind, tokens)


@dataclass_transform(frozen_default=True, kw_only_default=True)
def options(kind: type[T]) -> type[T]:
    """Decorator of options that only the command line has."""
    return FLAT(request(kind))


@options
class CodeOptions:
    """Whether the Python files that a scenario names may be executed."""

    no_user_code: bool = False
    """Refuse parts in Python files, which are executed."""
    code_from_anywhere: bool = False
    """Allow Python files outside the folder of the file that names them."""


def option(key: str) -> str:
    """A field's name as users write it."""
    return f"--{key.replace('_', '-')}"


def as_options(text: str, options: dict[str, str]) -> str:
    """A message about arguments of functions as one about options: `{"to": "--out"}`."""
    for key, name in options.items():
        if text.startswith(f"{key}: "):
            text = name + text.removeprefix(key)
    return text
