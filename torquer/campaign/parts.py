"""A campaign in parts, each flown by a machine of its own, without any cluster software."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.campaign.joining import in_blocks, join_chunks, write_blocks
from torquer.campaign.spec import Campaign
from torquer.campaign.store import ALIKE, in_words
from torquer.simulation.results.file import explain_errors, lazily


class Part(NamedTuple):
    """Part `number` of `total`, of which the first is 1."""

    number: int
    total: int

    def members(self, runs: int) -> np.ndarray:
        """The members of this part, of `runs`: neighbours."""
        first, last = (runs * k // self.total for k in (self.number - 1, self.number))
        return np.arange(first, last)


def check_part(part: Sequence[int] | None, campaign: Campaign) -> Part | None:
    """A part of a campaign; ValueError for one that it does not have."""
    if part is None:
        return None
    numbers = tuple(part)
    whole = all(isinstance(each, int) and not isinstance(each, bool) for each in numbers)
    if len(numbers) != 2 or not whole or not 1 <= numbers[0] <= numbers[1] <= campaign.runs:
        shown = "/".join(map(str, numbers))
        raise ValueError(
            f"part: must be K/N with 1 <= K <= N <= {campaign.runs} (runs); received {shown}"
        )
    if campaign.stop is not None:
        raise ValueError(
            "part: must not be given with campaign.stop, which looks at all members so far; "
            "received both"
        )
    return Part(*numbers)


def join_parts(
    files: Sequence[str | os.PathLike], to: str | os.PathLike | None = None
) -> xr.Dataset:
    """One campaign of the files of its parts, as if it had been flown at once.

    `files`: results of `fly_campaign(..., part=(k, n))`, in any order; `to`: a file for the whole.
    ValueError for parts of different campaigns, laws, packages or machines that compute other
    digits, for members that two parts have differently, and for those that none has.

        >>> varied, campaign = torquer.load_campaign("releases.toml")
        >>> for k in (1, 2):  # each on a machine of its own
        ...     part = torquer.fly_campaign(varied, campaign, to=f"part{k}.nc", part=(k, 2))
        >>> torquer.join_parts(["part1.nc", "part2.nc"]).sizes["member"]
        4
    """
    paths = [Path(file) for file in files]
    if not paths:
        raise ValueError("files: must be one or more; received none")
    if to is not None and Path(to).exists():
        raise ValueError(f"to: must hold no campaign; received {to}: remove it, or choose another")
    parts = [_load_part(path) for path in paths]
    for path, part in zip(paths, parts, strict=True):
        _check_alike(paths[0], parts[0], path, part)
    found = [part["member"].values for part in parts]
    runs = Campaign.model_validate_json(parts[0].attrs["campaign"]).runs
    _check_complete(found, runs)
    _check_agreement(paths, parts, found)
    blocks = in_blocks(paths, found, np.arange(runs), parts[0].attrs)
    if to is not None:
        return write_blocks(blocks, runs, Path(to))
    return join_chunks([*blocks], parts[0].attrs)


def _load_part(path: Path) -> xr.Dataset:
    with explain_errors(path):
        try:
            data = lazily(path)
        except OSError as error:
            raise ValueError(
                f"files: must be files that can be read; received {path} ({error.strerror})"
            ) from None
        if "member" not in data.coords or not data.sizes["member"] or "campaign" not in data.attrs:
            raise ValueError(f"files: must be of campaigns; received {path}")
    return data


def _check_alike(first_path: Path, first: xr.Dataset, path: Path, part: xr.Dataset) -> None:
    """ValueError unless two parts are of one campaign."""
    for key in ALIKE:
        if part.attrs.get(key) != first.attrs.get(key):
            raise ValueError(
                f"files: must be parts of one campaign; received {path}, whose {key} is another "
                f"than that of {first_path}"
            )
    if part.data_vars.keys() != first.data_vars.keys() or not part["time"].equals(first["time"]):
        raise ValueError(
            f"files: must be parts of one campaign; received {path}, whose variables or times are "
            f"others than those of {first_path}"
        )


def _check_complete(found: list[np.ndarray], runs: int) -> None:
    """ValueError unless parts have all members of a campaign, and no others."""
    numbers = np.unique(np.concatenate(found))
    missing = np.setdiff1d(np.arange(runs), numbers)
    if len(missing):
        raise ValueError(
            f"files: must have all {runs} members; received {len(numbers)}, without "
            f"{in_words(missing)}"
        )
    if (extra := np.setdiff1d(numbers, np.arange(runs))).size:
        raise ValueError(f"files: must have members below {runs}; received {in_words(extra)}")


def _check_agreement(
    paths: Sequence[Path], parts: list[xr.Dataset], found: list[np.ndarray]
) -> None:
    """ValueError for a member that two parts have differently."""
    numbers, count = np.unique(np.concatenate(found), return_counts=True)
    for member in numbers[count > 1]:
        having = [
            (n, row) for n, each in enumerate(found) for row in np.flatnonzero(each == member)
        ]
        rows = [parts[n].isel(member=row) for n, row in having]
        if not all(row.identical(rows[0]) for row in rows):
            raise ValueError(
                f"files: must agree in what they have both; received another member {member} in "
                f"{paths[having[0][0]]} than in {paths[having[-1][0]]}"
            )
