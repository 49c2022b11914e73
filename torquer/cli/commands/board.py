"""`torquer board`: a scenario as sliders in the browser."""

from pathlib import Path
from typing import Annotated

from torquer.base.limits import within
from torquer.cli.compiling import compiling_shown
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions, options
from torquer.cli.output import check_installed, print_note, show_address

#: The port of the page unless another is given.
PORT = 8422
_NEEDS = ("starlette", "uvicorn", "websockets")


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
    check_installed("board", _NEEDS)
    import torquer.scenario
    from torquer.pages.board.server import BoardServer
    from torquer.pages.browser.throttle import Throttle
    from torquer.scenario.load import name_after, read_text

    if scenario is None:
        scenario = Path(torquer.scenario.__file__).with_name("start.toml")
        name, folder = "satellite", Path()
    else:
        name, folder = name_after(scenario), scenario.parent
    load_checked(scenario, code)  # a page that begins with an error helps nobody
    server = BoardServer(read_text(scenario, "scenario"), name, folder, how.port or 0)
    with compiling_shown():
        server.board.make_ready()
    server.serve(
        lambda: show_address(server, Path(), how.no_browser),
        Throttle(lambda line: print_note(f"request refused: {line}")).note,
    )
    return 0
