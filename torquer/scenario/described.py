"""Description of a table of files and of its keys; `torquer.scenario.keys` makes it."""

from typing import NamedTuple


class Key(NamedTuple):
    """A key of a table; `values`: its kind and range in words, `default`: "" if it must be given.

    A key of a table that may be left out has the default "none".
    """

    name: str
    description: str
    unit: str
    values: str
    default: str


class Table(NamedTuple):
    """A table of a file: where it may appear, its kind or "", its description, its keys."""

    places: list[str]
    kind: str
    about: str
    keys: list[Key]

    @property
    def title(self) -> str:
        """The first place, and the kind."""
        where = self.places[0] or "(top of the file)"
        return f"{where}, kind = {self.kind!r}" if self.kind else where
