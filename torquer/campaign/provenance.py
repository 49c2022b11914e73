"""What the numbers of a member depend on besides its scenario, as it is in this process.

Threads share it. A process, and a worker of a cluster above all, may have another copy of a file,
another version of a package, or functions of another C library: it is asked before it flies.
"""

import functools
import hashlib
import json
import math
import os
import platform
import socket
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from torquer.base.user_code import own_files
from torquer.base.user_source import mark_with_imports
from torquer.campaign.files import code_named
from torquer.campaign.spec import Campaign
from torquer.compile.sources import PACKAGE, are_edited, mark_files
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import versions

#: Folders of the package on which no number depends.
_NOT_COUNTED = {"__pycache__", "web", "templates"}
#: What else numbers depend on.
_OF_MACHINE = "processor", "functions of the C library and NumPy"
#: Arguments at which functions are looked at; whole numbers of them are within all domains.
_AT = np.linspace(-0.999, 0.999, 1001)


class OtherProvenance(ValueError):
    """A worker would compute other numbers, or may do so."""


def files_named(
    scenario: Scenario, campaign: Campaign, computer: str | os.PathLike | None
) -> dict[str, str]:
    """The user's files that members are flown with, by the keys that name them."""
    named = {key: part.file for key, part in own_files(scenario).items()}
    named |= dict(code_named(campaign))
    if computer is not None:
        named["computer"] = Path(computer)
    return {key: str(file) for key, file in named.items()}


def provenance(files: Mapping[str, str] | None = None) -> dict[str, str]:
    """What numbers depend on here, by what it is; `files`: the user's, by their keys."""
    return {
        "package": package_mark(),
        **versions(),
        **dict(zip(_OF_MACHINE, (platform.machine(), _functions_mark()), strict=True)),
        **{f"{key} ({file})": _file_mark(Path(file)) for key, file in (files or {}).items()},
    }


def check_provenance(expected: Mapping[str, str], found: Mapping[str, str]) -> None:
    """OtherProvenance, with the name of this process, unless it has what is expected."""
    for what, mark in expected.items():
        if found.get(what) != mark:
            raise OtherProvenance(
                "where: must have workers with the files, the package and the libraries of this "
                f"campaign; received {_own_name()}, which has {found.get(what, 'nothing')} as its "
                f"{what}, not {mark}"
            )


def check_same_provenance(path: Path, stated: str) -> None:
    """ValueError unless a campaign that is in a file goes on with the package that began it.

    `stated`: what the file says of it, as JSON.
    """
    began, now = json.loads(stated), provenance()
    for what in ("package", *versions(), *_OF_MACHINE):
        if what in began and began[what] != now[what]:
            raise ValueError(
                f"to: must hold a campaign that was begun with this {what}, {now[what]}; received "
                f"{path} of {began[what]}"
            )


@functools.cache
def package_mark() -> str:
    """Mark of the files of the package that numbers may depend on, as this process loaded them."""
    files = [
        path
        for path in sorted(PACKAGE.rglob("*"))
        if path.is_file() and not _NOT_COUNTED & {*path.relative_to(PACKAGE).parts}
    ]
    if are_edited(files):
        return f"{os.getpid()}, edited since this process began"
    digest = hashlib.sha256()
    for path in files:
        digest.update(str(path.relative_to(PACKAGE)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _functions_mark() -> str:
    """Mark of what functions return here: their last digits are the library's and processor's."""
    positive = np.abs(_AT) + 1e-3
    rows = [
        *(of(30.0 * _AT) for of in (np.sin, np.cos, np.tan, np.arctan, np.exp)),
        *(of(_AT) for of in (np.arcsin, np.arccos)),
        *(of(positive) for of in (np.log, np.sqrt)),
        *(np.power(positive, 0.3), np.arctan2(_AT, positive)),
    ]
    one_by_one = (math.sin, math.cos, math.tan, math.asin, math.acos, math.atan, math.exp)
    rows += [np.array([of(x) for x in _AT.tolist()]) for of in one_by_one]
    rows += [np.array([of(x) for x in positive.tolist()]) for of in (math.log, math.sqrt)]
    return hashlib.sha256(b"".join(row.tobytes() for row in rows)).hexdigest()[:16]


def _file_mark(file: Path) -> str:
    """Mark of a user's file, or of the C of an exported computer's folder."""
    try:
        if file.is_dir():
            return mark_files(sorted([*file.rglob("*.c"), *file.rglob("*.h")]))
        return mark_with_imports(file) if file.is_file() else "no such file"
    except (OSError, SyntaxError, ValueError) as error:
        return f"a file that cannot be read ({type(error).__name__})"


def _own_name() -> str:
    """The name of this process: its machine and its number."""
    return f"process {os.getpid()} on {socket.gethostname()}"
