"""`torquer gallery`: published figures and tables, recomputed and compared."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from torquer.cli.options import Json

app = App(
    name="gallery",
    help="Published figures and tables, recomputed and compared with the printed numbers.",
    version_flags=[],
)

Out = Annotated[Path, Parameter(help="Folder for the pictures.")]
Docs = Annotated[
    Path | None, Parameter(help="Also write pages and small pictures into this folder.")
]
_OUT = Path("runs/gallery")


@app.command(name="list")
def list_(*, json: Json = False) -> int:
    """List the catalogue: id, verdict if available, content."""
    from torquer.cli import gallery_work as work

    return work.show_list(json)


@app.command
def run(*ids: str, json: Json = False, out: Out = _OUT) -> int:
    """Compute the entries of these IDS; exit 1 if a verdict differs from the declared one."""
    from torquer.cli import gallery_work as work

    return work.run(ids, json, out)


@app.command(name="all")
def all_(*, json: Json = False, out: Out = _OUT, docs: Docs = None) -> int:
    """Compute every available entry; exit 1 if a verdict differs from the declared one."""
    from torquer.cli import gallery_work as work

    return work.run_all(json, out, docs)
