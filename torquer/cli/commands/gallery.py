"""`torquer gallery`: published figures and tables, recomputed and compared."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.options import Json

Out = Annotated[Path, Parameter(help="Folder for the pictures.")]
Docs = Annotated[
    Path | None, Parameter(help="Also write pages and small pictures into this folder.")
]
_OUT = Path("runs/gallery")
#: The checkout that holds the gallery next to the package; an installed package has none.
CHECKOUT = Path(__file__).parents[3]


def _work():
    """The work of the commands; ValueError where there is no gallery."""
    if not (CHECKOUT / "gallery/lookup.py").is_file():
        raise ValueError(
            "gallery: must be run from a checkout of torquer's repository; received an installed "
            "package"
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.append(str(CHECKOUT))
    from torquer.cli.commands import gallery_work

    return gallery_work


def list_(*, json: Json = False) -> int:
    """List the catalogue: id, verdict if available, content."""
    return _work().show_list(json)


def run(*ids: str, json: Json = False, out: Out = _OUT, docs: Docs = None) -> int:
    """Compute the entries of these IDS; exit 1 if a verdict differs from the declared one."""
    return _work().run(ids, json, out, docs)


def all_(*, json: Json = False, out: Out = _OUT, docs: Docs = None) -> int:
    """Compute every available entry; exit 1 if a verdict differs from the declared one."""
    return _work().run_all(json, out, docs)
