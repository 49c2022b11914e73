"""What of its memory a program reads. What nothing reads is in no struct, and is not stored.

A translation notes what its kernels read; the next one leaves out all else. The first one holds
nothing for read but what others look at, so that fields which only serve each other vanish.
"""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field

#: By what is indexed ("Known.readings", or an argument) and how many dimensions are left: places.
Cells = dict[tuple[str, int], set[int]]


@dataclass
class Reads:
    """`fields`: of records, "Known.t_s"; `parts`: of named tuples, by their class; `cells`: places
    in arrays that are read or written.
    """

    fields: set[str] = field(default_factory=set)
    parts: set[tuple[type, str]] = field(default_factory=set)
    cells: Cells = field(default_factory=dict)

    def add(self, other: "Reads") -> None:
        """All of another."""
        self.fields |= other.fields
        self.parts |= other.parts
        for key, places in other.cells.items():
            self.add_cells(*key, places)

    def joined(self, other: "Reads") -> "Reads":
        """What either reads."""
        found = Reads()
        found.add(self)
        found.add(other)
        return found

    def add_cells(self, root: str, dimensions: int, places: set[int]) -> None:
        """Places in the first of the dimensions that are left of an array."""
        self.cells.setdefault((root, dimensions), set()).update(places)

    def cells_of(self, root: str) -> dict[int, set[int]]:
        """Places in an array, by how many dimensions are left."""
        return {left: places for (name, left), places in self.cells.items() if name == root}


class Noted:
    """What a kernel reads as it is translated. `muted`: marks of the nodes whose values are not
    needed.
    """

    def __init__(self) -> None:
        self.reads = Reads()
        self.muted: set[int] = set()

    @contextlib.contextmanager
    def apart(self) -> Iterator[Reads]:
        """What is noted within the block is kept apart."""
        outer, self.reads = self.reads, Reads()
        yield self.reads
        self.reads = outer
