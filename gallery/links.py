"""Where an entry's code stands, the formulas that it names, and whether the errata have it."""

import functools
import inspect
import re
from pathlib import Path

from gallery.catalogue import SOURCES
from gallery.lookup import entry_of

_ROOT = Path(__file__).parents[1]
_SOURCE = "|".join(SOURCES)
#: A formula of a source that is named, or of the entry's own.
_FORMULA = re.compile(rf"(?:\b({_SOURCE}) )?\((\d+\.\d+(?:\.\d+)*)\)")
_INDEXED = re.compile(rf"^\| ((?:{_SOURCE}) \([\d.]+\)) \|", re.MULTILINE)


def where(data: dict) -> str:
    """A line of links for an entry's record; "" for one that is no entry of the gallery."""
    if (entry := entry_of().get(data["id"])) is None:
        return ""
    file = Path(inspect.getfile(entry.compute)).relative_to(_ROOT).as_posix()
    parts = [f"Code: `{file}`."]
    if named := formulas(data):
        links = (f"[{key}](../equations.md#{key.split()[0].lower()})" for key in named)
        parts.append(f"Formulas: {', '.join(links)}.")
    if any(
        re.search(rf"gallery [^|]*\b{re.escape(id_)}\b", _page("errata")) for id_ in data["ids"]
    ):
        parts.append("[Errata](../errata.md).")
    return " ".join(parts)


def formulas(data: dict) -> list[str]:
    """The formulas that the texts of an entry and its file name, as far as the index has them."""
    about = inspect.getmodule(entry_of()[data["id"]].compute).__doc__ or ""
    checks = (f"{check['name']} {check['expected']}" for check in data["checks"])
    text = " ".join([data["title"], data["expected"], data["reason"], data["note"], *checks, about])
    own = data["id"].split("-", 1)[0]
    found = {f"{source or own} ({number})": None for source, number in _FORMULA.findall(text)}
    return [key for key in found if key in _indexed()]


@functools.cache
def _indexed() -> frozenset[str]:
    return frozenset(_INDEXED.findall(_page("equations")))


@functools.cache
def _page(name: str) -> str:
    path = _ROOT / "docs" / f"{name}.md"
    return path.read_text(encoding="utf-8") if path.exists() else ""
