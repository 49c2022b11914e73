"""What the commands write to: streams that take any text, consoles, folders.

A code page of Windows, or a pipe in the C locale, has no degree sign, no Greek, and none of what
a path or a description may hold. Signs that have a plain way of being written are written so, all
others by their numbers, as in `\\u4e2d`; nothing is lost, and nothing ends in an error.
"""

import codecs
import os
import sys
import warnings
from contextlib import contextmanager, suppress
from pathlib import Path

#: Plain ways to write the signs that the package itself prints.
PLAIN = {
    "°": " deg", "²": "^2", "³": "^3", "₀": "0", "µ": "u", "μ": "u", "ω": "omega",
    "·": "*", "×": "x", "±": "+-", "−": "-", "–": "-", "—": "-", "…": "...",  # noqa: RUF001
    "’": "'", "‘": "'", "“": '"', "”": '"', "→": "->", "≤": "<=", "≥": ">=", "≈": "~",  # noqa: RUF001
}  # fmt: skip
_ERRORS = "torquer.plain"


def _written_plainly(error: UnicodeError) -> tuple[str, int]:
    """What stands for signs that an encoding lacks, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(PLAIN.get(sign) or ascii(sign)[1:-1] for sign in lacking), error.end


def let_streams_take_any_text() -> None:
    """From now on standard output and error end in no encoding error.

    Signs that the font of the pictures lacks are shown there as boxes; it is not worth a warning.
    """
    warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)
    codecs.register_error(_ERRORS, _written_plainly)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # there may be none, or one of a caller's own
            stream.reconfigure(errors=_ERRORS)


def finish_output() -> None:
    """Write out what is still held back, so that an error shows now and not at the exit."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def drop_output() -> None:
    """What cannot be written, to a closed pipe or a full disk, is not tried again at the exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def tell_error(text: str) -> None:
    """Lines on standard error; where even that is full, the exit code has to do."""
    with suppress(OSError):
        for line in text.splitlines():
            print(f"error: {line}", file=sys.stderr)


@contextmanager
def writing_to(out: Path, option: str = "--out"):
    """Within the block an error of writing is said to be one of that folder."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise ValueError(
            f"{option}: must be a folder that can be written; received {out} "
            f"({error.strerror or error})"
        ) from None


def make_writable(out: Path, option: str = "--out") -> None:
    """Find out before the work, not after it, that the results can be written."""
    with writing_to(out, option):
        out.mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.touch()
        probe.unlink()


def console(stderr: bool = False, **keys):
    """A console whose text is taken as it is: square brackets and colons are no markup."""
    from rich.console import Console

    class Plain(Console):
        def on_broken_pipe(self) -> None:
            raise  # the command ends as it does without a console

    return Plain(stderr=stderr, markup=False, emoji=False, highlight=False, **keys)
