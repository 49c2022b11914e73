"""The command line: `main`, which can be interrupted cleanly before anything slow is imported."""

import gc
import sys

from torquer.cli import process
from torquer.cli.output import let_streams_take_any_text

#: When Python looks for garbage: seldom, as a command imports much and leaves little; a tenth of
#: the time of a short run.
_GARBAGE = (500_000, 50, 100)


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit code 0 on success, 1 if a run failed or a verdict differs from the declared
    one, 2 on a user error, 130 on an interrupt."""
    process.own_process = arguments is None
    if process.own_process:
        gc.set_threshold(*_GARBAGE)
        process.ask_for_one_thread()
    let_streams_take_any_text()
    try:
        with process.interrupt_imports():
            from torquer.cli.answer import answer

            code = answer(arguments)
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        code = process.INTERRUPTED_CODE
    if process.own_process:
        gc.freeze()  # otherwise Python collects garbage as it exits, which takes half a second
    sys.exit(code)
