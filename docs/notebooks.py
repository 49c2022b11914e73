"""Run the notebooks of `examples/notebooks` again, and keep what their cells print and draw.

    python docs/notebooks.py [NOTEBOOK ...]

Cells run in order in one fresh namespace, in an empty folder. A cell keeps what it printed and the
value of its last line, as Jupyter does: text, a picture, or a table as HTML. Jupyter is not needed.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import linecache
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

FOLDER = Path(__file__).parents[1] / "examples" / "notebooks"
#: Colours of a kept picture: fewer make a smaller file.
_COLOURS = 64


def read(path: Path) -> dict[str, Any]:
    """A notebook as the table that its file holds."""
    return json.loads(path.read_text(encoding="utf-8"))


def text_of(notebook: dict[str, Any]) -> str:
    """A notebook as the text of its file."""
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def execute(notebook: dict[str, Any], name: str) -> dict[str, Any]:
    """The notebook with the outputs of its code cells; an error in a cell is raised.

    `name` names its cells in error messages.
    """
    namespace: dict[str, Any] = {"__name__": "__main__"}
    cells, count = [], 0
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                count += 1
                source = "".join(cell["source"])
                outputs = _outputs(source, namespace, f"<{name}, cell {count}>", count)
                cell = cell | {"execution_count": count, "outputs": outputs}
            cells.append(cell)
    return notebook | {"cells": cells}


def _outputs(source: str, namespace: dict[str, Any], place: str, count: int) -> list[dict]:
    """What a cell prints, and the value of its last line, as outputs of a notebook."""
    # inspect, and so a law of the cell, finds its source here, as it does in Jupyter
    linecache.cache[place] = (len(source), None, source.splitlines(keepends=True), place)
    tree = ast.parse(source, place)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, place, "exec"), namespace)
        value = None
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), place, "eval"), namespace)
    outputs: list[dict] = []
    if text := printed.getvalue():
        outputs.append({"name": "stdout", "output_type": "stream", "text": _lines(text)})
    if value is not None:
        outputs.append(
            {
                "data": _shown(value),
                "execution_count": count,
                "metadata": {},
                "output_type": "execute_result",
            }
        )
    return outputs


def _shown(value: object) -> dict[str, Any]:
    """A value by the types of content that a notebook can show."""
    shown: dict[str, Any] = {}
    if hasattr(value, "_repr_png_"):
        shown["image/png"] = base64.b64encode(_small(value._repr_png_())).decode("ascii")
    elif hasattr(value, "_repr_html_"):
        shown["text/html"] = _lines(value._repr_html_())
    return shown | {"text/plain": _lines(repr(value))}


def _small(png: bytes) -> bytes:
    """A picture with few colours."""
    out = io.BytesIO()
    Image.open(io.BytesIO(png)).quantize(_COLOURS).save(out, "PNG", optimize=True)
    return out.getvalue()


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def main() -> None:
    """Run the notebooks that are named, or all, and write them with their outputs."""
    for path in map(Path, sys.argv[1:] or sorted(FOLDER.glob("*.ipynb"))):
        path.write_text(text_of(execute(read(path), path.stem)), encoding="utf-8")
        print(path)


if __name__ == "__main__":
    main()
