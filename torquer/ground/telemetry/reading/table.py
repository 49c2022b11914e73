"""The columns of a file before they are interpreted, and what was noteworthy in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pandas as pd


class Finding(NamedTuple):
    """Something noteworthy in telemetry: a short key, how many rows, what in words."""

    key: str
    rows: int
    text: str


class Table(NamedTuple):
    """Columns of a file, the units that it states for them, its format.

    `is_utc`: columns of dates without a zone that are UTC by the format's own definition.
    `meanings`: what the file says of its columns.
    """

    data: pd.DataFrame
    units: dict[str, str]
    format: str
    is_utc: frozenset[str] = frozenset()
    meanings: dict[str, str] = {}  # noqa: RUF012
    notes: tuple[Finding, ...] = ()
