"""What commands that serve a page share."""

import importlib.util
import threading
import webbrowser
from collections.abc import Sequence


def check_installed(command: str, modules: Sequence[str]) -> None:
    """ValueError for a command whose optional modules are missing."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise ValueError(
            f"{command}: needs {', '.join(missing)}, which `pip install 'torquer[{command}]'` adds"
        )


def show_address(address: str, no_browser: bool) -> None:
    """Print the address of a page, and open it in a browser."""
    print(f"{address}\nCtrl-C ends it", flush=True)
    if not no_browser:
        # it may wait for a browser to end, as it does for those in a terminal
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
