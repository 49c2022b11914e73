"""Numbers uniform on 0..1, from which the values of a member are made: one row per member.

A row depends only on the campaign and the member's number, not on which members are asked for
together.
"""

import hashlib
import warnings
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from torquer.base.noise import fill_words
from torquer.campaign.spec import MOST_MEMBERS, Campaign

_32, _6 = np.uint64(32), np.uint64(6)
#: Half a step of Sobol points of scipy, which may be 0, where a quantile would be infinite.
_HALF_STEP = 2.0**-31


def unit_numbers(campaign: Campaign, members) -> np.ndarray:
    """Numbers above 0 and below 1 [n, campaign.unit_numbers] of members by their numbers [n].

    Columns: keys of `vary` in their order, then those of `correlated`.
    """
    members = checked_members(members)
    if not campaign.unit_numbers or not members.size:
        return np.empty((members.size, campaign.unit_numbers))
    return _SAMPLINGS[campaign.sampling](campaign, members)


def checked_members(members, most: int = MOST_MEMBERS) -> np.ndarray:
    """Numbers of members as an array (n,), below `most`."""
    members = np.atleast_1d(np.asarray(members))
    if members.ndim != 1 or (members.size and members.dtype.kind not in "iu"):
        raise ValueError(f"members: must be a list of whole numbers; received {members!r}")
    if members.size and not (members.min() >= 0 and members.max() < most):
        raise ValueError(
            f"members: must lie within 0..{most - 1}; received {members.min()} to {members.max()}"
        )
    return members.astype(np.int64)


def random_words(seed: int, name: str, members: np.ndarray) -> np.ndarray:
    """64 random bits [n] of members, of a stream with a name."""
    out = np.empty((len(members), 1, 2), np.uint64)
    fill_words(seed, *_stream(name), members, out)
    return (out[:, 0, 0] << _32) | out[:, 0, 1]


def _stream(name: str) -> tuple[int, int]:
    """Two 32-bit words of a name: 64 bits, so that no two keys have one stream."""
    digest = hashlib.sha256(name.encode()).digest()
    return int.from_bytes(digest[:4], "big"), int.from_bytes(digest[4:8], "big")


def _random(campaign: Campaign, members: np.ndarray) -> np.ndarray:
    """Independent members; the name of a key selects its stream, whatever other keys vary."""
    streams = campaign.groups.items()
    columns = [_stream_numbers(campaign.seed, f"vary {name}", members, n) for name, n in streams]
    return np.hstack(columns)


def _stream_numbers(seed: int, name: str, members: np.ndarray, count: int) -> np.ndarray:
    """Numbers [n, count] in the middle of 2^52 cells: never 0 or 1, whose quantiles are infinite.

    (53 bits would leave no room for the half.)
    """
    words = np.empty((len(members), count, 2), np.uint64)
    fill_words(seed, *_stream(name), members, words)
    cells = (words[..., 0] >> _6).astype(float) * 2.0**26 + (words[..., 1] >> _6).astype(float)
    return (cells + 0.5) * 2.0**-52


def _latin_hypercube(campaign: Campaign, members: np.ndarray) -> np.ndarray:
    """Blocks of `runs` members, each a Latin hypercube: members beyond the runs begin another."""
    blocks, rows = np.divmod(members, campaign.runs)
    out = np.empty((len(members), campaign.unit_numbers))
    for block in np.unique(blocks):
        of_block = blocks == block
        cube = _hypercube(campaign.runs, campaign.unit_numbers, campaign.seed, int(block))
        out[of_block] = cube[rows[of_block]]
    return np.clip(out, 2.0**-53, 1.0 - 2.0**-53)


@lru_cache(maxsize=1)
def _hypercube(runs: int, numbers: int, seed: int, block: int) -> np.ndarray:
    """One whole hypercube; kept, as members are asked for in many parts."""
    from scipy.stats import qmc  # half a second of importing, for those who need it

    sampler = qmc.LatinHypercube(numbers, seed=np.random.default_rng([seed, block]))
    cube = sampler.random(runs)
    cube.flags.writeable = False
    return cube


def _saltelli(campaign: Campaign, members: np.ndarray) -> np.ndarray:
    """Saltelli's design, point after point: A, B, then for each group A with the group of B.

    A and B are the two halves of a point of the scrambled Sobol sequence.
    """
    points, places = np.divmod(members, campaign.members_per_point)
    count = campaign.unit_numbers
    halves = _sobol(campaign, points, 2 * count)
    groups = np.repeat(np.arange(len(campaign.groups)), [*campaign.groups.values()])
    of_b = (places == 1)[:, None] | (places[:, None] == 2 + groups)
    return np.where(of_b, halves[:, count:], halves[:, :count])


def noise_numbers(campaign: Campaign, members: np.ndarray) -> np.ndarray:
    """Numbers of the members whose noise members have: usually their own.

    In a point of Saltelli's design it is that of A, for all but B: what differs between A and
    another member is due to the group that was exchanged, and to nothing else.
    """
    if campaign.sampling != "saltelli":
        return members
    places = members % campaign.members_per_point
    return members - np.where(places == 1, 0, places)


def _sobol(campaign: Campaign, numbers: np.ndarray, count: int | None = None) -> np.ndarray:
    """Points [n, count] of the scrambled Sobol sequence; `count`: that of a member unless given."""
    from scipy.stats import qmc

    order, back = np.unique(numbers, return_inverse=True)
    rng = np.random.default_rng(campaign.seed)
    engine = qmc.Sobol(campaign.unit_numbers if count is None else count, seed=rng)
    rows, at = [], 0
    with warnings.catch_warnings():
        # a part of the members is no power of 2, whatever the whole is
        warnings.filterwarnings("ignore", "The balance properties", UserWarning)
        for run in np.split(order, np.flatnonzero(np.diff(order) > 1) + 1):
            if run[0] > at:
                engine.fast_forward(int(run[0]) - at)
            rows.append(engine.random(len(run)))
            at = int(run[-1]) + 1
    return np.clip(np.vstack(rows), _HALF_STEP, 1.0 - _HALF_STEP)[back]


def _grid(campaign: Campaign, members: np.ndarray) -> np.ndarray:
    """The middle of the part of 0..1 that represents a value; the last key changes fastest."""
    if members.max() >= campaign.runs:
        raise ValueError(
            f"members: must lie within 0..{campaign.runs - 1} of the grid; received {members.max()}"
        )
    shape = np.array(campaign.grid)
    places = np.column_stack(np.unravel_index(members, campaign.grid))
    return (places + 0.5) / shape


_SAMPLINGS: dict[str, Callable[[Campaign, np.ndarray], np.ndarray]] = {
    "random": _random,
    "latin_hypercube": _latin_hypercube,
    "sobol": _sobol,
    "saltelli": _saltelli,
    "grid": _grid,
}
