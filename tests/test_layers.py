"""The floors of the house: imports only point down."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import torquer
from torquer.base.lazy import homes_in

PACKAGE = Path(torquer.__file__).parent
#: From the ground up; a room may import rooms of lower floors, and itself.
FLOORS = (
    {
        "conventions",
        "compile",
        "interface",
        *("validate", "spec", "noise", "time", "lazy", "version", "file_limits", "strict_json"),
    },
    {"packets"},
    {"geometry"},
    {"integrate"},
    {"earth"},
    {"orbit"},
    {"environment"},
    {"wheel_array"},
    {"spacecraft"},
    {"estimation"},
    {"control"},
    {"scenario"},
    {"simulation"},
    {"export"},
    {"theory"},
    {"notes"},
    {"analysis"},
    {"campaign"},
    {"onboard"},
    {"link"},
    {"browser"},
    {"ground", "board"},
    {"telemetry"},
    {"report"},
    {"cli", "__main__"},
)
#: Public names and the modules they come from.
HOMES = homes_in(PACKAGE.joinpath("__init__.py").read_text(encoding="utf-8"))
FLOOR_OF = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
FILES = sorted(PACKAGE.rglob("*.py"))


def room_of(place: str) -> str:
    """Room of a dotted place: torquer.maths.geometry.vec3 -> geometry."""
    parts = place.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def place_of(file: Path) -> str:
    """Dotted place of a file of the package."""
    parts = list(file.relative_to(PACKAGE.parent).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(tree: ast.AST, place: str, is_package: bool):
    """Dotted places of the package that a module imports, functions' own imports included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                up = place.split(".")[: len(place.split(".")) - node.level + is_package]
                base = ".".join([*up, *([base] if base else [])])
            if base == "torquer":
                yield from (f"torquer.{alias.name}" for alias in node.names)
            else:
                yield base


def upward(source: str, place: str, is_package: bool = False) -> list[str]:
    """Imports of a module that do not point down; what the package's own page names counts too."""
    own, found = room_of(place), []
    for target in imports_of(ast.parse(source), place, is_package):
        if target.split(".")[0] != "torquer":
            continue
        room = room_of(target)
        if room in FLOOR_OF:
            lower = FLOOR_OF[room] < FLOOR_OF[own]
            same = room == own or FLOOR_OF[room] == FLOOR_OF[own] == 0
            if lower or same:
                continue
        elif own == "cli" and target == "torquer":
            continue
        found.append(target)
    return found


def test_every_room_has_its_floor():
    rooms = {room_of(place_of(file)) for file in FILES} - {"__init__", "__main__"}
    assert rooms <= set(FLOOR_OF), "give each new room its floor in FLOORS"


def test_imports_point_down():
    files = {file: place_of(file) for file in FILES}
    found = {
        place: upward(file.read_text(encoding="utf-8"), place, file.name == "__init__.py")
        for file, place in files.items()
        if room_of(place) not in ("__init__", "__main__")
    }
    assert {place: targets for place, targets in found.items() if targets} == {}


@pytest.mark.parametrize(
    ("place", "source", "wrong"),
    [
        ("torquer.maths.geometry.vec3", "from torquer.compile.engine import kernel", []),
        ("torquer.maths.geometry.vec3", "import numpy as np", []),
        ("torquer.compile.engine", "from torquer import validate", []),
        ("torquer.compile.engine", "import torquer", ["torquer"]),
        ("torquer.cli.app", "import torquer", []),
        (
            "torquer.maths.geometry.vec3",
            "from torquer.maths.integrate import rk4",
            ["torquer.maths.integrate"],
        ),
        (
            "torquer.maths.geometry.vec3",
            "import torquer.environment.orbit.kepler",
            ["torquer.environment.orbit.kepler"],
        ),
        ("torquer.maths.geometry.vec3", "from torquer import orbit", ["torquer.environment.orbit"]),
        ("torquer.maths.geometry.vec3", "def f():\n    import torquer.cli", ["torquer.cli"]),
        (
            "torquer.environment.orbit.kepler",
            "from torquer.environment import sun",
            ["torquer.environment"],
        ),
        ("torquer.environment.sun", "from torquer.environment.orbit import kepler", []),
        (
            "torquer.base.noise",
            "from torquer.maths.geometry import vec3",
            ["torquer.maths.geometry"],
        ),
        (
            "torquer.maths.geometry.vec3",
            "from ..orbit import kepler",
            ["torquer.environment.orbit"],
        ),
        ("torquer.maths.geometry.vec3", "from . import quaternion", []),
        ("torquer.maths.geometry.vec3", "from .. import orbit", ["torquer.environment.orbit"]),
        ("torquer.maths.geometry.vec3", "from torquer import Scenario", ["torquer.Scenario"]),
    ],
)
def test_the_test_sees_what_points_up(place, source, wrong):
    assert upward(source, place) == wrong


def is_for_type_checkers(node: ast.AST) -> bool:
    """Whether a statement is an `if TYPE_CHECKING:`, which never runs."""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def first_page() -> list[ast.stmt]:
    """Statements of the package's `__init__`."""
    return ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8")).body


def test_the_first_page_imports_the_standard_library_only():
    """So that `import torquer` costs nothing: names are imported when they are asked for."""
    assert torquer.TYPE_CHECKING is False
    code = (
        "import sys; import torquer; torquer.__all__; "
        "print(*sorted({name.split('.')[0] for name in sys.modules} & {'numpy', 'numba', 'scipy'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout.split()) == (0, [])


def test_type_checkers_take_the_names_for_public_ones():
    (block,) = filter(is_for_type_checkers, first_page())
    for node in block.body:
        for alias in node.names:
            assert alias.asname == alias.name, "without `as` it is not taken for a public name"


def test_every_public_name_is_where_the_first_page_says():
    for name in torquer.__all__:
        if name == "__version__":
            continue
        place = PACKAGE.joinpath(*HOMES[name].split(".")[1:])
        homes = (place.with_suffix(".py"), place / "__init__.py")
        assert any(home.exists() for home in homes), f"{name}: no {HOMES[name]}"
    with pytest.raises(AttributeError, match="module 'torquer' has no attribute 'nothing'"):
        _ = torquer.nothing
