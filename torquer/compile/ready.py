"""Kernels that somebody compiled before: a folder that is only read, and never needed.

`TORQUER_KERNELS` names it; otherwise it is that of the package `torquer_kernels`, if that is
installed. Its code is for any processor of its kind ("generic"), so it can be moved from one
machine to another. It holds `kernels.json`, which says what the code was compiled for, and then the
same files as the cache of compiled code, each sealed by a digest of its place and content.
"""

import hashlib
import importlib.util
import json
import os
import stat
import sys
import sysconfig
from importlib.metadata import version
from pathlib import Path

MANIFEST = "kernels.json"
VARIABLE = "TORQUER_KERNELS"
#: Numba's settings for code that every processor of a kind can execute.
GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}


def is_ours(found: os.stat_result) -> bool:
    """Whether something belongs to this user or to the administrator."""
    return found.st_uid in (os.getuid(), 0)


def is_private(found: os.stat_result) -> bool:
    """Whether something is ours, and nobody else can write there."""
    if not hasattr(os, "getuid"):  # Windows keeps users apart by itself
        return True
    return is_ours(found) and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def compiled_for(sources: str) -> dict[str, str]:
    """What code must have been compiled for to be of use here; `sources`: their digest."""
    return {
        "python": sys.implementation.cache_tag,
        "platform": sysconfig.get_platform(),
        "numba": version("numba"),  # without loading them
        "llvmlite": version("llvmlite"),
        "processor": GENERIC["NUMBA_CPU_NAME"],
        "sources": sources,
    }


def ready_folder(sources: str) -> tuple[Path | None, str]:
    """The folder of kernels for these sources, and why there is none ("" if none was given)."""
    named = os.environ.get(VARIABLE)
    found = None if named is not None else importlib.util.find_spec("torquer_kernels")
    places = list(found.submodule_search_locations or ()) if found else [named] if named else []
    if not places:
        return None, ""
    folder = Path(places[0]).absolute()
    reason = _unusable(folder, compiled_for(sources))
    return (None, f"{reason}; compiling instead") if reason else (folder, "")


def _unusable(folder: Path, needed: dict[str, str]) -> str:
    """Why a folder's kernels cannot be used here; "" if they can."""
    try:
        given = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        places = [folder.stat(), *(each.stat() for each in folder.glob("*/"))]
    except (OSError, ValueError) as error:
        return f"compiled kernels in {folder}: cannot be read: {error}"
    if not all(map(is_private, places)):
        return f"compiled kernels in {folder}: belong to, or can be written by, others"
    if not isinstance(given, dict):
        return f"compiled kernels in {folder}: {MANIFEST} must hold a table"
    for key, value in needed.items():
        if given.get(key) != value:
            return f"compiled kernels in {folder}: are for {key} {given.get(key)}, needed {value}"
    return ""


def write_manifest(folder: Path, sources: str) -> None:
    """State what the code in a folder was compiled for."""
    text = json.dumps(compiled_for(sources), indent=1) + "\n"
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def processor() -> str:
    """Kind of processor that is compiled for: its name and a mark of its instructions."""
    import llvmlite.binding as llvm
    import numba

    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = numba.config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    return f"{name} ({hashlib.sha256(features.encode()).hexdigest()[:8]})"
