"""The floors of the house: imports only point down."""

import ast
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import torquer
from torquer.base.lazy import homes_in

PACKAGE = Path(torquer.__file__).parent
#: Public names and the modules they come from.
HOMES = homes_in(PACKAGE.joinpath("__init__.py").read_text(encoding="utf-8"))
ROOT = Path(__file__).parents[1]


def house_module():
    """The script that measures the structure."""
    spec = importlib.util.spec_from_file_location("house", ROOT / "docs" / "house.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


house = house_module()


@pytest.fixture(scope="module")
def whole():
    """The package as it is read."""
    return house.read_house(ROOT)


def test_no_two_rooms_import_each_other(whole):
    """So imports only point down: the floors are derived from them."""
    assert house.circles(whole.arrows) == []


def test_no_two_files_import_each_other(whole):
    """Also within functions and for type checkers."""
    assert house.file_circles(whole) == []


def test_the_top_of_the_package_is_short(whole):
    assert house.figures(whole)["entries at the top"] <= 19


def test_the_picture_is_of_this_house(whole):
    drawn = (ROOT / house.PICTURE).read_text(encoding="utf-8")
    assert drawn == house.picture(whole), "run docs/house.py --draw"


def test_the_command_line_is_imported_by_nobody(whole):
    assert [arrow for arrow in whole.arrows if arrow[1] == "cli"] == []


@pytest.fixture
def small_house(tmp_path):
    """`small_house({"a/x.py": "import torquer.b.y"})`: a package of these files, as it is read."""

    def build(files):
        for place, source in files.items():
            path = tmp_path / "torquer" / place
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(source)
            (path.parent / "__init__.py").touch()
        (tmp_path / "torquer" / "__init__.py").touch()
        return house.read_house(tmp_path)

    return build


@pytest.mark.parametrize(
    "source",
    [
        "from torquer.b.y import f",
        "from torquer.b import y",
        "import torquer.b.y",
        "from ..b import y",
        "def f():\n    from torquer.b import y",
        "if TYPE_CHECKING:\n    from torquer.b.y import f",
    ],
)
def test_every_kind_of_import_counts(small_house, source):
    seen = small_house({"a/x.py": source, "b/y.py": "from torquer.a import x"})
    assert set(seen.arrows) == {("a", "b"), ("b", "a")}
    assert house.circles(seen.arrows) == [{"a", "b"}]
    assert {"torquer.a.x", "torquer.b.y"} in house.file_circles(seen)


@pytest.mark.parametrize("rooms", ["ab", "abc", "abcde"])
def test_a_circle_of_any_length_has_one_arrow_up(small_house, rooms):
    following = zip(rooms, rooms[1:] + rooms[0], strict=True)
    seen = small_house({f"{a}/x.py": f"from torquer.{b} import x" for a, b in following})
    assert house.circles(seen.arrows) == [set(rooms)]
    assert len(house.upward(seen.arrows)) == 1
    assert sorted(house.floors_of(seen.rooms, seen.arrows).values()) == [*range(len(rooms))]


def test_a_room_without_imports_stands_on_the_ground(small_house):
    seen = small_house({"a/x.py": ""})
    assert (house.circles(seen.arrows), house.file_circles(seen)) == ([], [])
    assert house.floors_of(seen.rooms, seen.arrows) == {"a": 0}


def test_what_is_not_imported_does_not_count(small_house):
    other = "import numpy\nfrom . import z\nfrom json import loads"
    seen = small_house({"a/x.py": other, "a/z.py": "", "b/y.py": "from torquer.a import x"})
    assert (set(seen.arrows), house.file_circles(seen)) == ({("b", "a")}, [])
    assert house.floors_of(seen.rooms, seen.arrows) == {"a": 0, "b": 1}


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
