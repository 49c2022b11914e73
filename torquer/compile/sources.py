"""Which sources compiled code is made of: a hash of them names its folder."""

import functools
import hashlib
import re
import sys
import time
from collections.abc import Iterable, Mapping
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
    texts = {path: path.read_bytes() for path in sorted(PACKAGE.rglob("*.py"))}
    holders = {path for path, text in texts.items() if _ENGINE.search(text)}
    folders = {folder for path in holders for folder in path.relative_to(PACKAGE).parents}
    folders.discard(Path())
    return {p: text for p, text in texts.items() if p.relative_to(PACKAGE).parent in folders}


def source_key(of_compiler: bool = True) -> str:
    """Hash of every source file that can hold a kernel and, unless left out, of Numba's version."""
    return hash_sources(kernel_sources(), of_compiler)


def hash_sources(sources: Mapping[Path, bytes], of_compiler: bool = True) -> str:
    """`source_key` of sources that have been read."""
    digest = hashlib.sha256()
    if of_compiler:
        digest.update(f"{version('numba')} {sys.implementation.cache_tag}".encode())
    for path, text in sources.items():
        digest.update(str(path.relative_to(PACKAGE)).encode() + text)
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
