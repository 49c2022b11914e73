"""What a study is: its cases, by name, and what the page says of their results."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

#: Flies a case with so many members, or with its own number of them: one row each.
Fly = Callable[[int | None], list[dict]]


class Study(NamedTuple):
    """A row of the list of studies.

    `name`: of its files; `cases`: what it flies; `section`: the page's text, of stored results;
    `picture`: file of the picture and the figure, likewise.
    """

    name: str
    cases: Mapping[str, Fly]
    section: Callable[[], str]
    picture: tuple[str, Callable]


def draw_share(axes, times, end: float, **keys) -> None:
    """Share [%] of the starts that are there, over time until the end; NaN: never there."""
    there = np.sort(times[np.isfinite(times)], axis=None)
    shares = 100.0 * np.arange(len(there) + 1) / times.size
    axes.step([0.0, *there, end], [*shares, shares[-1]], where="post", lw=1.4, **keys)
