"""`torquer init`: a commented scenario to start from, by size if asked, or a copy of an example."""

import re
import sysconfig
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.language import message, told
from torquer.base.limits import RequestError
from torquer.base.strict_json import json_text
from torquer.cli.compiling import compiling_shown
from torquer.cli.options import FLAT, Json
from torquer.cli.output import say, writing_to
from torquer.design.requests import SheetRequest
from torquer.simulation.results.file import put

_START = Path(__file__).parents[2] / "scenario" / "start.toml"
_DESCRIPTION = re.compile(r'^(description = )"(.*)"', re.M)
#: Files that an example names, which come with it.
_NAMED = re.compile(r'^\s*(?:file|.*\bfile)\s*=\s*"([^"]+)"', re.M)


def examples() -> dict[str, Path]:
    """The examples by name: next to the package in a source tree, among its data when installed."""
    package = Path(__file__).parents[2]
    data = Path(sysconfig.get_path("data"))
    folders = (package.parent / "examples", data / "share" / "torquer" / "examples")
    for folder in folders:
        found = {path.stem: path for path in sorted(folder.glob("*.toml"))}
        if "chibis_m_detumble" in found:
            dozen = sorted(folder.glob("satellites/*.toml"))
            return found | {f"satellites/{path.stem}": path for path in dozen}
    return {}


def init(
    name: str | None = None,
    /,
    *,
    example: Annotated[
        str | None, Parameter(help="Copy this example instead, with the files it refers to.")
    ] = None,
    how: Annotated[SheetRequest, FLAT] = SheetRequest(),
    listed: Annotated[bool, Parameter(name="--list", help="List the examples.")] = False,
    json: Json = False,
) -> int:
    """Write NAME.toml: a commented scenario to start from.

    With --like it is a satellite of that size. Inertia, surfaces and residual dipole follow from
    size and mass, and B-dot has the gain of theory; with --wheels it slews and holds by wheels.
    What the data sheet leaves open varies in a campaign. Without NAME the file has the name of
    the size or of the example.
    """
    if listed:
        return _list(json)
    path = _file_of(how.like, example) if name is None else _file_for(name)
    text, others = _START.read_text(encoding="utf-8"), {}
    if how != SheetRequest():
        text = _described(_by_size(how, example))
    elif example is not None:
        source = _example(example)
        text = source.read_text(encoding="utf-8")
        others = {path.parent / file: source.parent / file for file in _NAMED.findall(text)}
    else:
        text = _described(text)
    for each in (path, *others):
        if each.exists():
            raise ValueError(f"NAME: must not name an existing file; received {each}")
    with writing_to(path.parent, "NAME"):
        put(path, text)
        for to, source in others.items():
            put(to, source.read_text(encoding="utf-8"))
    if json:
        print(json_text({"written": [str(each) for each in (path, *others)]}))
        return 0
    say(message("{files}: written", files=", ".join(str(each) for each in (path, *others))))
    print(f"torquer validate {path}")
    print(f"torquer run {path}")
    return 0


def _described(text: str) -> str:
    """A scenario with its description, which stands above each report, in the reader's language."""
    return _DESCRIPTION.sub(lambda found: f'{found[1]}"{told(found[2])}"', text)


def _file_of(like: str | None, example: str | None) -> Path:
    """The file named after a size or an example, which are checked where they are looked up."""
    if like is None and example is None:
        raise ValueError("NAME: must be given; received nothing")
    return Path(f"{like or str(example).rpartition('/')[2]}.toml")


def _file_for(name: str) -> Path:
    path = Path(name)
    if path.name and path.suffix != ".toml":
        path = path.with_name(f"{path.name}.toml")
    if not re.fullmatch(r"\w[\w.-]*", path.name):
        raise ValueError(
            "NAME: must begin with a letter, digit or '_' and hold only these, '-' and '.'; "
            f"received {name!r}"
        )
    return path


def _by_size(how: SheetRequest, example: str | None) -> str:
    """The scenario of a satellite of a size."""
    if example is not None:
        raise RequestError("like", "must not be given with --example; received both")
    with compiling_shown():
        from torquer.design.sheet import from_sheet

        return from_sheet(how).text


def _example(name: str) -> Path:
    known = examples()
    if name not in known:
        raise ValueError(f"--example: must be one of {', '.join(known)}; received {name!r}")
    return known[name]


def _list(as_json: bool) -> int:
    listed = {name: _about(path) for name, path in examples().items()}
    if as_json:
        print(json_text(listed))
        return 0
    wide = max(map(len, listed), default=0)
    print("\n".join(f"{name:<{wide}}  {about}" for name, about in listed.items()))
    return 0


def _about(path: Path) -> str:
    """The description of an example, or the first sentence of its comment."""
    text = path.read_text(encoding="utf-8")
    found = _DESCRIPTION.search(text)
    comment = re.match(r"(?:#.*\n)*", text)[0].replace("\n#", "")  # type: ignore[index]
    return found[2] if found else re.split(r"\.(?:\s|$)", comment)[0].removeprefix("# ").rstrip()
