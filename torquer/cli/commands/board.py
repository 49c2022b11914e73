"""`torquer board`: a scenario as sliders in the browser."""

from pathlib import Path
from typing import Annotated

from torquer.base.limits import within
from torquer.cli.options import CodeOptions, options

#: The port of the page unless another is given.
PORT = 8422


@options
class BoardOptions:
    """Options of `torquer board`."""

    port: Annotated[int | None, within(0, 65535)] = PORT
    """Port of the page on 127.0.0.1; 0: any free one."""
    no_browser: bool = False
    """Only print the address of the page."""


def board(
    scenario: Path | None = None,
    /,
    *,
    how: BoardOptions = BoardOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Show SCENARIO [that of `torquer init`] as sliders and plots in the browser, until Ctrl-C.

    Each change is flown at once and drawn next to what theory says; the verdict, pinned runs, and a
    campaign of 256 starts come with it. The page is served to this machine only, to whoever has the
    address that is printed.
    """
    from torquer.cli.commands import board_work as work

    return work.serve(scenario, how, code)
