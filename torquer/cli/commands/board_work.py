"""Work of `board`: the server of the page."""

from __future__ import annotations

from pathlib import Path

import torquer.scenario
from torquer.cli import compiling
from torquer.cli.commands.board import BoardOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions
from torquer.cli.output import check_installed, print_note, show_address
from torquer.scenario.load import name_after, text_of

_NEEDS = ("starlette", "uvicorn", "websockets")


def serve(path: Path | None, how: BoardOptions, code: CodeOptions) -> int:
    """Serve the page until a signal."""
    check_installed("board", _NEEDS)
    from torquer.pages.board.server import BoardServer

    if path is None:
        path = Path(torquer.scenario.__file__).with_name("start.toml")
        name, folder = "satellite", Path()
    else:
        name, folder = name_after(path), path.parent
    load_checked(path, code)  # a page that begins with an error helps nobody
    board = BoardServer(text_of(path, "scenario"), name, folder, how.port or 0)
    with compiling.compiling_shown():
        board.board.make_ready()
    board.serve(
        lambda: show_address(board.address, how.no_browser),
        lambda what: print_note(f"request refused: {what}"),
    )
    return 0
