"""Compiled code on the disk: in a folder of the user's own, every file sealed by a digest.

Numba believes what it finds in its cache, and what it finds is executed. So a folder in which
others can write is not used, and what is damaged is compiled again. Numba does not notice an edited
callee in another file either: the folder is named by a hash of all sources that hold kernels.
"""

import contextlib
import functools
import hashlib
import os
import stat
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path

from torquer.compile.ready import is_ours, is_private, ready_folder
from torquer.compile.sources import are_edited, hash_sources, kernel_sources, mark_files

_SEAL_BYTES = 32


class CacheNote(UserWarning):
    """Compiled code could not be kept, or not be used as it was found."""


_text: set[str] = set()


def tell(text: str) -> None:
    """Say something once in a process."""
    if text not in _text:
        _text.add(text)
        warnings.warn(text, CacheNote, stacklevel=2)


def cache_root() -> Path:
    """Folder of compiled kernels; `TORQUER_CACHE_DIR` moves it. OSError for a user without home."""
    if chosen := os.environ.get("TORQUER_CACHE_DIR"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    try:
        return (Path(base) if base else Path.home() / ".cache") / "torquer"
    except RuntimeError as error:
        raise OSError(str(error)) from None


def _root_for_now() -> Path:
    """Folder of this user among the temporary ones; its name is none that could be imported."""
    user = getattr(os, "getuid", lambda: "user")()
    return Path(tempfile.gettempdir()) / f"torquer-cache-{user}"


def _made_private(root: Path) -> Path:
    """The folder, made if it is missing; OSError unless it is ours and nobody else can write."""
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    if hasattr(os, "getuid"):  # Windows keeps users apart by itself
        found = root.stat() if root.is_symlink() and is_ours(root.lstat()) else root.lstat()
        if not stat.S_ISDIR(found.st_mode) or not is_private(found):
            raise PermissionError(f"{root} belongs to, or can be written by, others")
    return root


def _folder() -> Path | None:
    """Folder for compiled code; None if there is none in which it can be kept."""
    if _edited:
        tell("compiled code is not kept: torquer's files have changed since this process began")
        return None
    reasons = []
    for root_of in (cache_root, _root_for_now):
        try:
            folder = _made_private(_made_private(root_of()) / SOURCES)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError as error:
            reasons.append(str(error))
    tell(
        "compiled code is not kept, so that every start compiles for about half a minute: "
        + "; ".join(reasons)
    )
    return None


_sources = kernel_sources()
_edited = are_edited(_sources)
#: Digest of the sources.
SOURCES = hash_sources(_sources)
FOLDER = _folder()
READY, _reason = (None, "") if _edited else ready_folder(SOURCES)
if _reason:
    tell(_reason)


@functools.cache
def numba_config():
    """Numba's settings, which name the folder."""
    import numba

    if FOLDER or READY:
        numba.config.CACHE_DIR = str(FOLDER or READY / SOURCES)
    return numba.config


def seal_file(path: str, content: bytes | memoryview) -> bytes:
    """Digest of the content of a file and of its place in the cache, which may be moved whole."""
    whole = Path(path)
    root = READY if READY and whole.is_relative_to(READY) else FOLDER.parent if FOLDER else None
    place = os.path.relpath(path, root).replace(os.sep, "/")
    digest = hashlib.sha256(f"{place}\n".encode())
    digest.update(content)
    return digest.digest()


def is_sound(path: str) -> bool:
    """Whether a file is as it was written there, or not there."""
    try:
        content = memoryview(Path(path).read_bytes())
    except FileNotFoundError:
        return True
    except OSError as error:
        tell(f"compiling again: {error}")
        return False
    if seal_file(path, content[:-_SEAL_BYTES]) == content[-_SEAL_BYTES:]:
        return True
    tell(f"compiled code in {os.path.dirname(path)} is damaged: compiling again")
    return False


#: The user's files that name the cache folder now, by their whole path.
_users: ContextVar[frozenset[Path]] = ContextVar("_users", default=frozenset())


@contextlib.contextmanager
def user_cache(files: Iterable[Path]) -> Iterator[None]:
    """Compile, within the block, into a cache folder named by the content of the user's files."""
    config = numba_config()
    usual, files = config.CACHE_DIR, list(files)
    if FOLDER:
        config.CACHE_DIR = str(FOLDER / f"user-{mark_files(files)}")
    before = _users.set(frozenset(path.resolve() for path in files))
    try:
        yield
    finally:
        config.CACHE_DIR = usual
        _users.reset(before)


def names_the_folder(file: str) -> bool:
    """Whether a user's file is one of those whose content names the cache folder now.

    Wherever it stands, its code is found again: a copied project starts at once.
    """
    return FOLDER is not None and Path(file).resolve() in _users.get()
