"""Which sources compiled code is made of: a hash of them names its folder."""

import functools
import hashlib
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent
#: What a file imports that holds kernels: the engine, or names of it.
_ENGINE = re.compile(rb"from torquer\.compile(\.engine import|\b import .*\bengine\b)")
_BEGAN_S = time.time()


def kernel_sources() -> dict[Path, bytes]:
    """Sources in and above the folders that hold kernels, but for the package's own page.

    Editing any other leaves compiled code valid.
    """
    texts = {place: _read(place) for place in sorted(_all_sources())}
    holders = {os.path.dirname(place) for place, text in texts.items() if _ENGINE.search(text)}
    folders = {str(above) for each in holders for above in (Path(each), *Path(each).parents)}
    folders -= {str(PACKAGE), *map(str, PACKAGE.parents)}
    return {Path(p): text for p, text in texts.items() if os.path.dirname(p) in folders}


def _all_sources() -> Iterator[str]:
    """Files of the package; as texts, since a thousand `Path`s take longer than reading them."""
    for folder, inner, files in os.walk(PACKAGE):
        inner[:] = [name for name in inner if name != "__pycache__"]
        yield from (os.path.join(folder, name) for name in files if name.endswith(".py"))


def _read(file: str) -> bytes:
    with open(file, "rb", buffering=0) as opened:
        return opened.read()


def source_key(of_compiler: bool = True) -> str:
    """Hash of every source file that can hold a kernel and, unless left out, of Numba's version."""
    return hash_sources(kernel_sources(), of_compiler)


def hash_sources(sources: Mapping[Path, bytes], of_compiler: bool = True) -> str:
    """`source_key` of sources that have been read."""
    digest = hashlib.sha256()
    if of_compiler:
        digest.update(f"{version('numba')} {sys.implementation.cache_tag}".encode())
    for path, text in sources.items():
        digest.update(str(path)[len(str(PACKAGE)) :].encode() + text)
    return digest.hexdigest()[:16]


def are_edited(sources: Iterable[Path]) -> bool:
    """Whether one has changed since this process began, which then runs other code than it holds.

    Unknown, and so true, if it is there no more.
    """
    try:
        return any(path.stat().st_mtime > _BEGAN_S for path in sources)
    except OSError:
        return True


def is_own(function) -> bool:
    """Whether a Python function is from this package, whose sources name the cache folder."""
    return _is_inside(function.__code__.co_filename, PACKAGE)


@functools.cache
def _is_inside(file: str, folder: Path) -> bool:
    return Path(file).resolve().is_relative_to(folder)


def mark_files(files: Iterable[Path]) -> str:
    """Hash of the names and the content of files."""
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
