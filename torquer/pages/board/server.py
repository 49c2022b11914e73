"""The board as a process: its page on this machine only, until a signal."""

from __future__ import annotations

from collections.abc import Callable, Container
from pathlib import Path

from torquer.pages.board.routes import Board, application
from torquer.pages.board.text import data_from_toml, files_in
from torquer.pages.browser.guard import POLICY
from torquer.pages.browser.server import LocalServer


class BoardServer(LocalServer):
    """Serves the board of a TOML text at `address`.

    `name` is used where the text gives none; `folder`: where its relative paths begin; `code`: the
    Python files that it may execute, by default those that the text names. ValueError for a port
    that is taken, and for a text that is no TOML.
    """

    def __init__(
        self, text: str, name: str, folder: Path, port: int = 0, code: Container[Path] | None = None
    ):
        data = data_from_toml(text)
        if code is None:
            code = {file for _, file in files_in(data, folder)}
        self.board = Board(data, str(data.get("name", name)), folder, code)
        super().__init__(port)

    def serve(
        self,
        ready: Callable[[], None] = lambda: None,
        refused: Callable[[str, str], None] = lambda reason, what: None,
    ) -> None:
        """Serve until a signal, or `stop` from another thread; `refused`: see `Guard`."""
        try:
            app, ending = application(self.board, ready), self.board.ending.set
            self.serve_application(app, POLICY, "torquer board", refused, ending)
        finally:
            self.close()
