"""Compiled code on the disk: in a folder of the user's own, every file sealed by a digest.

Numba believes what it finds in its cache, and what it finds is executed. So a folder in which
others can write is not used, and what is damaged is compiled again. Numba does not notice an edited
callee in another file either: the folder is named by a hash of all sources that hold kernels.
"""

import contextlib
import copy
import functools
import hashlib
import io
import os
import stat
import sys
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    UserProvidedCacheLocator,
)
from numba.core.runtime import rtsys

from torquer.compile.parts import rebuilt
from torquer.compile.private_folder import is_ours, is_private
from torquer.compile.ready import GENERIC, ready_folder

PACKAGE = Path(__file__).resolve().parent.parent
#: What a file imports that holds kernels.
_ENGINE = b"from torquer.compile.engine import"
_SEAL_BYTES = 32


class CacheNote(UserWarning):
    """Compiled code could not be kept, or not be used as it was found."""


_text: set[str] = set()


def _tell(text: str) -> None:
    """Say something once in a process."""
    if text not in _text:
        _text.add(text)
        warnings.warn(text, CacheNote, stacklevel=2)


def kernel_sources() -> dict[Path, bytes]:
    """Sources in and above the folders that hold kernels, but for the package's own page.

    Editing any other leaves compiled code valid.
    """
    texts = {path: path.read_bytes() for path in sorted(PACKAGE.rglob("*.py"))}
    holders = {path for path, text in texts.items() if _ENGINE in text}
    folders = {folder for path in holders for folder in path.relative_to(PACKAGE).parents}
    folders.discard(Path())
    return {p: text for p, text in texts.items() if p.relative_to(PACKAGE).parent in folders}


def source_key(of_compiler: bool = True) -> str:
    """Hash of every source file that can hold a kernel and, unless left out, of Numba's version."""
    digest = hashlib.sha256()
    if of_compiler:
        digest.update(f"{numba.__version__} {sys.implementation.cache_tag}".encode())
    for path, text in kernel_sources().items():
        digest.update(str(path.relative_to(PACKAGE)).encode() + text)
    return digest.hexdigest()[:16]


def is_own(function) -> bool:
    """Whether a Python function is from this package, whose sources name the cache folder."""
    return Path(function.__code__.co_filename).resolve().is_relative_to(PACKAGE)


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
    reasons = []
    for root_of in (cache_root, _root_for_now):
        try:
            folder = _made_private(_made_private(root_of()) / SOURCES)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError as error:
            reasons.append(str(error))
    _tell(
        "compiled code is not kept, so that every start compiles for about half a minute: "
        + "; ".join(reasons)
    )
    return None


#: Digest of the sources as they were when this process began.
SOURCES = source_key()
FOLDER = _folder()
READY, _reason = ready_folder(SOURCES)
if _reason:
    _tell(_reason)
if FOLDER or READY:
    numba.config.CACHE_DIR = str(FOLDER or READY / SOURCES)


class _SealedFile(IndexDataCacheFile):
    """Numba's files of an entry, each with a digest of its place and content behind the content.

    Data states the signature that it was compiled for: of two processes that compile for different
    signatures at once, one may keep the index and the other the data.
    """

    def save(self, key, data):
        super().save(key, (key, data))

    def load(self, key):
        found = super().load(key)
        if found is None or found[0] == key:
            return found and found[1]
        _tell(f"compiled code in {self._cache_path} is of another signature: compiling again")
        return None

    def _load_index(self):
        return super()._load_index() if _is_sound(self._index_path) else {}

    def _load_data(self, name):
        if not _is_sound(path := self._data_path(name)):
            raise OSError(f"{path} is damaged")  # taken as missing
        return super()._load_data(name)

    @contextlib.contextmanager
    def _open_for_write(self, filepath):
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue())
            file.write(_seal_of(filepath, content.getbuffer()))


def _seal_of(path: str, content: bytes | memoryview) -> bytes:
    """Digest of the content of a file and of its place in the cache, which may be moved whole."""
    whole = Path(path)
    root = READY if READY and whole.is_relative_to(READY) else FOLDER.parent if FOLDER else None
    place = os.path.relpath(path, root).replace(os.sep, "/")
    digest = hashlib.sha256(f"{place}\n".encode())
    digest.update(content)
    return digest.digest()


def _is_sound(path: str) -> bool:
    """Whether a file is as it was written there, or not there."""
    try:
        content = memoryview(Path(path).read_bytes())
    except FileNotFoundError:
        return True
    except OSError as error:
        _tell(f"compiling again: {error}")
        return False
    if _seal_of(path, content[:-_SEAL_BYTES]) == content[-_SEAL_BYTES:]:
        return True
    _tell(f"compiled code in {os.path.dirname(path)} is damaged: compiling again")
    return False


@functools.cache
def _place(folder: str) -> str:
    """Name of a folder of the package by its place there; "" for any other folder."""
    whole = Path(folder).resolve()
    within = whole.is_relative_to(PACKAGE)
    return ".".join(whole.relative_to(PACKAGE.parent).parts) if within else ""


class _Locator(UserProvidedCacheLocator):
    """Our folder alone; it was tried on import, not once more for each of 500 functions.

    The package's own code is found again wherever the package is installed: its place is that in
    the package, and FOLDER is named by the sources' content already.
    """

    def ensure_cache_path(self):
        os.makedirs(self.get_cache_path(), exist_ok=True)

    @classmethod
    def get_suitable_cache_subpath(cls, py_file):
        return _place(os.path.dirname(py_file)) or super().get_suitable_cache_subpath(py_file)

    def get_source_stamp(self):
        return SOURCES if _place(os.path.dirname(self._py_file)) else super().get_source_stamp()


class _Files(CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _FilesOfParts(_Files):
    def rebuild(self, target_context, payload):
        return rebuilt(target_context, payload)


class _SealedCache(FunctionCache):
    """Numba's cache of a function, in such files; what it lacks may be among the ready kernels."""

    _impl_class = _Files

    def __init__(self, py_func):
        super().__init__(py_func)
        self._use_files(self._impl.filename_base)

    def _use_files(self, base: str) -> None:
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _SealedFile(self._cache_path, base, stamp)
        self._ready_file = None
        if READY and stamp == SOURCES:
            place = READY / SOURCES / Path(self._cache_path).name
            self._ready_file = _SealedFile(str(place), base, stamp)

    def of_parts(self) -> "_SealedCache":
        """The cache of the function's form for kernels, in the same folders."""
        made = copy.copy(self)
        made._impl = _FilesOfParts(self._py_func)
        made._use_files(f"{self._impl.filename_base}.for_kernels")
        return made

    def _load_overload(self, sig, target_context):
        found = super()._load_overload(sig, target_context)
        if found is None and self._ready_file:
            key = _generic(self._index_key(sig, target_context.codegen()))
            if data := self._ready_file.load(key):
                found = self._impl.rebuild(target_context, data)
        return found

    def load_overload(self, sig, target_context):
        """What is on the disk, without the compiler's tables, which only compiling needs: loading
        them takes a quarter of a second."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def save_overload(self, sig, data):
        """Keep compiled code if there is room for it."""
        try:
            if FOLDER:
                super().save_overload(sig, data)
        except OSError as error:
            _tell(f"compiled code is not kept, so that it is compiled at every start: {error}")


def _generic(key):
    """The key of an entry, for a processor of any kind."""
    signature, (triple, *_), code = key
    return signature, (triple, *GENERIC.values()), code


def kept(function):
    """A function of Numba, not compiled yet, whose compiled code is kept on the disk.

    That of a notebook's cell, which has no file, is compiled in every process.
    """
    if not (FOLDER or READY) or not hasattr(function, "enable_caching"):
        return function
    if not os.path.exists(function.py_func.__code__.co_filename):
        return function
    try:
        cache = _SealedCache(function.py_func)
    except (RuntimeError, OSError) as error:
        _tell(f"compiled code is not kept, so that it is compiled at every start: {error}")
        return function
    if Path(cache.cache_path).is_relative_to(FOLDER or READY):  # the locator may be another
        function._cache = cache
    return function


def kept_with(function, for_kernels):
    """The form of a function for kernels, kept where the function is."""
    cache = getattr(function, "_cache", None)
    if isinstance(cache, _SealedCache):
        for_kernels._cache = cache.of_parts()
    return for_kernels


def keep_off_disk(*kernels) -> None:
    """From now on compile these kernels for this process alone."""
    for each in kernels:
        for form in (each, getattr(each, "for_kernels", None)):
            if hasattr(form, "_cache"):
                form._cache = NullCache()


def mark_of(files: Iterable[Path]) -> str:
    """Hash of the names and the content of files."""
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@contextlib.contextmanager
def cache_of(files: Iterable[Path]) -> Iterator[None]:
    """Compile, within the block, into a cache folder named by the content of the user's files."""
    usual = numba.config.CACHE_DIR
    if FOLDER:
        numba.config.CACHE_DIR = str(Path(usual) / f"user-{mark_of(files)}")
    try:
        yield
    finally:
        numba.config.CACHE_DIR = usual
