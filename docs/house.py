"""The structure of the package, measured from its imports.

    python docs/house.py                 # the figures of this checkout
    python docs/house.py --tree OTHER    # those of another one
    python docs/house.py --draw          # docs/img/house.svg, the picture of ARCHITECTURE.md

A *room* is a folder or module at the top of `torquer/`. An *arrow* joins two rooms if a file of the
first imports one of the second, also within a function or for type checkers only. A *floor* is the
number of rooms below a room, one under another. A *circle* is a group of files, or of rooms, that
import each other.
"""

import argparse
import ast
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PICTURE = Path("docs/img/house.svg")
Arrow = tuple[str, str]
#: What is run to count the modules of the package that it loads.
STARTS = {
    "import torquer.ground": "import torquer.ground",
    "import torquer.ground.contact": "import torquer.ground.contact",
    "import torquer.scenario.load": "import torquer.scenario.load",
    "torquer --help": "from torquer.cli import main; main(['--help'])",
    "torquer validate": "from torquer.cli import main; main(['validate', 'examples/bench.toml'])",
}
_COUNTED = """
import atexit, os, sys
def tell():
    own = sum(name.split(".")[0] == "torquer" for name in sys.modules)
    heavy = [name for name in ("numba", "scipy") if name in sys.modules]
    os.write(2, f"\\nLOADED {own} {' '.join(heavy)}\\n".encode())
atexit.register(tell)
"""


class House(NamedTuple):
    """Files of the package with the files that they import."""

    tree: Path
    files: dict[str, Path]
    imports: dict[str, set[str]]

    @property
    def rooms(self) -> list[str]:
        """Folders and modules at the top of the package, without its own page."""
        return sorted({room_of(place) for place in self.files} - {"__init__", "__main__"})

    @property
    def arrows(self) -> Counter[Arrow]:
        """How many imports join two rooms."""
        pairs = (
            (room_of(a), room_of(b))
            for a, targets in self.imports.items()
            for b in targets
            if room_of(a) not in ("__init__", "__main__")
        )
        return Counter((a, b) for a, b in pairs if a != b and b != "__init__")


def room_of(place: str) -> str:
    """Room of a dotted place: torquer.maths.geometry.vec3 -> maths."""
    return [*place.split("."), "__init__"][1]


def read_house(tree: Path) -> House:
    """The package of a checkout."""
    files = {place_of(path, tree): path for path in sorted((tree / "torquer").rglob("*.py"))}
    imports = {place: set(imported(path, place, files)) for place, path in files.items()}
    return House(tree, files, imports)


def place_of(path: Path, tree: Path) -> str:
    """Dotted place of a file."""
    parts = path.relative_to(tree).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path: Path, place: str, files):
    """Places of the package that a file imports or registers as commands, wherever it says so."""
    is_package = path.name == "__init__.py"
    if place == "torquer":
        return  # the package's own page lists public names, which are imported when asked for
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        for target in _targets(node, place, is_package):
            if target in files and target != place:
                yield target


def _targets(node: ast.AST, place: str, is_package: bool):
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            parts = place.split(".")
            up = parts[: len(parts) - node.level + is_package]
            base = ".".join([*up, *([base] if base else [])])
        inner = [f"{base}.{alias.name}" for alias in node.names]
        yield from inner
        yield base


def circles(arrows) -> list[set[str]]:
    """Groups of places that reach each other."""
    places = sorted({place for arrow in arrows for place in arrow})
    if not places:
        return []
    number = {place: k for k, place in enumerate(places)}
    pairs = np.array([(number[a], number[b]) for a, b in arrows], dtype=int).reshape(-1, 2)
    ones = np.ones(len(pairs), dtype=int)
    graph = csr_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(places),) * 2)
    _, group = connected_components(graph, connection="strong")
    groups = [{places[k] for k in np.flatnonzero(group == g)} for g in range(group.max() + 1)]
    return [found for found in groups if len(found) > 1]


def file_circles(house: House) -> list[set[str]]:
    """Groups of files that import each other."""
    return circles([(a, b) for a, targets in house.imports.items() for b in targets])


def upward(arrows: Counter[Arrow]) -> list[Arrow]:
    """The weakest arrow of a circle of rooms, again and again until no circle is left."""
    left, found = Counter(arrows), []
    while groups := circles(left):
        inside = (pair for pair in left if any(set(pair) <= group for group in groups))
        found.append(min(inside, key=lambda pair: (left[pair], pair)))
        del left[found[-1]]
    return found


def floors_of(rooms: list[str], arrows: Counter[Arrow]) -> dict[str, int]:
    """The floor of each room, by the arrows that point down."""
    down = set(arrows) - set(upward(arrows))
    floor: dict[str, int] = {}

    def find(room: str) -> int:
        if room not in floor:
            floor[room] = 1 + max((find(b) for a, b in down if a == room), default=-1)
        return floor[room]

    for room in rooms:
        find(room)
    return floor


def loaded(tree: Path, code: str) -> str:
    """How many modules of the package a start loads, and which of the heavy packages."""
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    done = subprocess.run(
        [sys.executable, "-c", _COUNTED + code],
        capture_output=True, text=True, cwd=tree, env=environment, timeout=300,
    )  # fmt: skip
    found = re.search(r"LOADED (\d+) ?(.*)", done.stderr)
    return f"{found[1]} modules, {found[2] or 'neither Numba nor SciPy'}" if found else "-"


def figures(house: House) -> dict[str, object]:
    """The figures of a house, by name."""
    package, arrows = house.tree / "torquer", house.arrows
    lines = sum(path.read_text(encoding="utf-8").count("\n") for path in house.files.values())
    top = [path for path in package.iterdir() if path.is_dir() or path.suffix == ".py"]
    own = [path for path in top if path.name != "__pycache__"]
    return {
        "entries at the top": len(own),
        "rooms": len(house.rooms),
        "floors": 1 + max(floors_of(house.rooms, arrows).values()),
        "arrows": len(arrows),
        "upward arrows": len(upward(arrows)),
        "circles of rooms": len(circles(arrows)),
        "circles of files": len(file_circles(house)),
        "files of cli/": len(list((package / "cli").rglob("*.py"))),
        "files": len(house.files),
        "lines": lines,
    }


def picture(house: House) -> str:
    """The rooms on their floors, with what each imports, as SVG."""
    return _drawn(floors_of(house.rooms, house.arrows), house.arrows)


_WIDE, _HIGH, _ACROSS, _DOWN, _EDGE = 150, 34, 178, 62, 20


def _drawn(floors: dict[str, int], arrows) -> str:
    """Boxes by floor; arrows that another path implies are left out."""
    top, place = max(floors.values()), {}
    for floor in range(top + 1):
        row = sorted(room for room in floors if floors[room] == floor)
        for k, room in enumerate(row):
            across = (k - (len(row) - 1) / 2) * _ACROSS + (30 if (top - floor) % 2 else -30)
            place[room] = (300 + across, _EDGE + (top - floor) * _DOWN)
    size = (600, 2 * _EDGE + top * _DOWN + _HIGH)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" '
        'font-family="sans-serif" font-size="13">',
        f'<rect width="{size[0]}" height="{size[1]}" fill="#ffffff"/>',
    ]
    for a, b in sorted(needed(arrows)):
        (x1, y1), (x2, y2) = place[a], place[b]
        bend = 60 * (1 if x2 >= x1 else -1) * ((y2 - y1) > _DOWN)
        middle = f"{(x1 + x2) / 2 + bend:g},{(y1 + _HIGH + y2) / 2:g}"
        path = f"M{x1:g},{y1 + _HIGH:g} Q{middle} {x2:g},{y2:g}"
        parts.append(f'<path d="{path}" fill="none" stroke="#9aa4b2"/>')
    for room, (x, y) in place.items():
        parts.append(
            f'<rect x="{x - _WIDE / 2:g}" y="{y}" width="{_WIDE}" height="{_HIGH}" rx="5" '
            f'fill="#eef3fa" stroke="#33557a"/><text x="{x:g}" y="{y + 22}" text-anchor="middle">'
            f"{room}/</text>"
        )
    return "\n".join([*parts, "</svg>", ""])


def needed(arrows) -> set[Arrow]:
    """The arrows that no path through other rooms implies."""
    below: dict[str, set[str]] = {}
    for a, b in arrows:
        below.setdefault(a, set()).add(b)

    def reach(room: str) -> set[str]:
        found, to_see = set(), [room]
        while to_see:
            further = below.get(to_see.pop(), set()) - found
            found |= further
            to_see += further
        return found

    return {
        (a, b) for a, b in arrows if not any(b in reach(other) for other in below[a] if other != b)
    }


def main() -> None:
    """Print the figures, or draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--tree", type=Path, default=ROOT, help="another checkout")
    parser.add_argument("--draw", action="store_true", help=f"write {PICTURE}")
    parser.add_argument("--circles", action="store_true", help="list the circles")
    asked = parser.parse_args()
    house = read_house(asked.tree.resolve())
    if asked.draw:
        (asked.tree / PICTURE).write_text(picture(house), encoding="utf-8")
        return
    for name, value in figures(house).items():
        print(f"{name:32} {value}")
    for name, code in STARTS.items():
        print(f"{name:32} {loaded(house.tree, code)}")
    if asked.circles:
        for group in [*circles(house.arrows), *file_circles(house)]:
            print("circle:", *sorted(group))


if __name__ == "__main__":
    main()
