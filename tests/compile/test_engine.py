"""The compute engine: the key of the cache, its folder, what is kept off the disk."""

import ast
import contextlib
import gc
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest

import torquer
from torquer.compile import engine, sources
from torquer.compile.code_cache import cache_root, user_cache
from torquer.compile.engine import caller, is_own, keep_off_disk, kernel, without_reference_counts
from torquer.compile.numba_private import code_address, event
from torquer.compile.sources import source_key

#: The first line of a file that holds kernels.
ENGINE = "from torquer.compile.engine import kernel\n"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A small package in the engine's eyes: kernels in two rooms, none in the others."""
    kernels = ("laws/bdot.py", "base/noise.py")
    for place in (*kernels, "laws/__init__.py", "scenario/load.py", "cli/__init__.py"):
        file = tmp_path / place
        file.parent.mkdir(exist_ok=True)
        file.write_text(ENGINE if place in kernels else "x = 1\n")
    monkeypatch.setattr(sources, "PACKAGE", tmp_path)
    return tmp_path


@pytest.mark.parametrize("place", ["laws/bdot.py", "laws/__init__.py", "base/noise.py"])
def test_editing_a_source_with_kernels_changes_the_key(package, place):
    before, text = source_key(), (package / place).read_text()
    assert source_key() == before
    (package / place).write_text(text + "y = 2\n")
    changed = source_key()
    assert changed != before
    (package / place).write_text(text)
    assert source_key() == before


@pytest.mark.parametrize("place", ["scenario/load.py", "cli/__init__.py"])
def test_editing_a_room_without_kernels_does_not(package, place):
    before = source_key()
    (package / place).write_text("x = 2\n")
    assert source_key() == before


def test_new_moved_and_removed_sources_change_the_key(package):
    keys = [source_key()]
    (package / "laws" / "new.py").write_text("x = 1\n")
    keys.append(source_key())
    (package / "laws" / "new.py").rename(package / "laws" / "newer.py")
    keys.append(source_key())
    assert len(set(keys)) == 3
    (package / "laws" / "newer.py").unlink()
    assert source_key() == keys[0]


def test_the_key_knows_the_compiler(package, monkeypatch):
    before = source_key()
    monkeypatch.setattr(sources, "version", {"numba": "0.0.0"}.get)
    assert source_key() != before


#: Decorators of compiled code.
DECORATORS = {"kernel", "released", "inlined", "called", "plugged"}


#: What has functions compiled that have no decorator.
COMPILERS = {"Entry", "FirstClass", "compile_plugin", "place_adapter"}


def decorators_of(function: ast.FunctionDef) -> set[str]:
    """Names of the decorators of a function, however they are reached."""
    return {
        d.attr if isinstance(d, ast.Attribute) else d.id
        for d in function.decorator_list
        if isinstance(d, ast.Attribute | ast.Name)
    }


def kernels_in(tree: ast.Module) -> list[ast.FunctionDef]:
    """Functions of a module that are compiled."""
    functions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    return [each for each in functions if decorators_of(each) & DECORATORS]


def has_functions_compiled(tree: ast.Module) -> bool:
    """Whether a module imports what compiles functions without a decorator."""
    imports = (node for node in tree.body if isinstance(node, ast.ImportFrom))
    return any(alias.name in COMPILERS for node in imports for alias in node.names)


def imported_from(tree: ast.Module, files: set[Path]) -> set[str]:
    """Names that a module imports from these files of the package."""
    names, folder = set(), sources.PACKAGE.parent
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("torquer"):
            home = folder.joinpath(*node.module.split("."))
            for alias in node.names:
                places = (home / f"{alias.name}.py", home.with_suffix(".py"), home / "__init__.py")
                if next(filter(Path.exists, places)) in files:
                    names.add(alias.asname or alias.name)
    return names


def test_the_key_covers_all_kernels_and_what_they_name():
    all_files = set(sources.PACKAGE.rglob("*.py"))
    inside = set(sources.kernel_sources())
    outside, seen = all_files - inside, 0
    for file in all_files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        kernels = kernels_in(tree)
        if (kernels or has_functions_compiled(tree)) and file not in inside:
            pytest.fail(f"{file} holds kernels that the key does not know")
        foreign = imported_from(tree, outside)
        for each in kernels:
            used = {node.id for node in ast.walk(each) if isinstance(node, ast.Name)}
            assert not used & foreign, f"{file}: {each.name}"
            seen += 1
    assert seen > 500
    rooms = {path.relative_to(sources.PACKAGE).parts[0] for path in inside}
    assert not rooms & {"campaign", "cli", "ground", "pages", "report", "scenario"}


def test_the_cache_folder_can_be_chosen(monkeypatch, tmp_path):
    monkeypatch.setenv("TORQUER_CACHE_DIR", str(tmp_path / "mine"))
    assert cache_root() == tmp_path / "mine"
    monkeypatch.delenv("TORQUER_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_root() == tmp_path / "xdg" / "torquer"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    assert cache_root() == Path.home() / ".cache" / "torquer"


def test_compiled_code_lies_in_a_folder_named_by_the_key():
    assert Path(numba.config.CACHE_DIR).name == source_key()


def test_a_users_files_name_a_cache_folder_of_their_own(tmp_path):
    file = tmp_path / "law.py"
    file.write_text("x = 1\n")
    usual, folders = numba.config.CACHE_DIR, []
    for text in ("x = 1\n", "x = 2\n", "x = 1\n"):
        file.write_text(text)
        with user_cache([file]):
            folders.append(numba.config.CACHE_DIR)
        assert usual == numba.config.CACHE_DIR
    assert folders[0] == folders[2] != folders[1]
    assert Path(folders[0]).parent == Path(usual)
    with pytest.raises(KeyError), user_cache([file]):
        raise KeyError
    assert usual == numba.config.CACHE_DIR


def test_own_functions_are_distinguished_from_others():
    assert is_own(source_key) and not is_own(in_a_process)


@pytest.mark.skipif(not engine.COMPILED, reason="there is no cache without a compiler")
def test_a_kernel_kept_off_the_disk_is_not_found_there():
    @engine.kernel
    def double(x):
        return 2 * x

    keep_off_disk(double)
    assert double(4) == 8
    assert not double.stats.cache_path
    assert not double.stats.cache_hits


@pytest.mark.skipif(not engine.COMPILED, reason="two forms of compiled code")
def test_only_what_python_calls_has_the_code_for_python():
    @engine.kernel
    def double(x):
        return 2 * x

    @engine.kernel
    def twice(x):
        return double(double(x))

    assert twice(3) == 12
    assert len(double.for_kernels.signatures) == 1 and not double.signatures
    assert not twice.for_kernels.signatures and len(twice.signatures) == 1
    assert double(4) == 8 and len(double.signatures) == 1
    assert double.for_kernels.targetoptions["no_cpython_wrapper"]
    assert twice.targetoptions == double.targetoptions and "forceinline" not in twice.targetoptions


def in_a_process(script, **environment):
    here = str(Path(torquer.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": here, **environment},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize("text", ["return x + 1.0", "return x.nothing"])
def test_garbage_collection_is_rarer_only_while_compiling(text):
    seen = []

    class Listener(event.Listener):
        def on_start(self, event):
            seen.append(gc.get_threshold()[0])

        def on_end(self, event):
            pass

    scope = {}
    exec(f"def made(x):\n    {text}", scope)
    usual, made = gc.get_threshold(), kernel(scope["made"])
    keep_off_disk(made)
    with (
        event.install_listener("numba:compile", Listener()),
        contextlib.suppress(numba.TypingError),
    ):
        made(1.0)
    assert seen
    assert min(seen) > usual[0]
    assert gc.get_threshold() == usual


def test_a_cache_folder_that_cannot_be_made_is_no_hindrance(tmp_path):
    (tmp_path / "file").write_text("")
    script = "from torquer.compile.code_cache import numba_config; print(numba_config().CACHE_DIR)"
    folder = in_a_process(script, TORQUER_CACHE_DIR=str(tmp_path / "file" / "cache"))[0]
    assert Path(folder).is_dir()
    assert Path(folder).parent.name.startswith("torquer-cache-")  # no name that one could import


def test_importing_the_package_is_light():
    script = "import sys, torquer; print(*{'numba', 'numpy', 'xarray', 'scipy'} & set(sys.modules))"
    assert in_a_process(script) == []


PROBLEM = """
import sys
import numpy as np
sys.path.insert(0, FOLDER)
from problem_of_test_engine import Growth
from torquer.maths.integrate.dop853 import dop853, workspace
y = np.ones(1)
dop853(Growth(1.0), 0.0, 1.0, y, 1e-10, 1e-12, 0.0, workspace(1))
print(round(y[0], 6))
"""
RATES = """
from typing import NamedTuple
from torquer.maths.integrate.dop853 import rates_of

class Growth(NamedTuple):
    k: float

@rates_of(Growth)
def rates_of_growth(problem, t, y, dy):
    dy[0] = SIGN * problem.k * y[0]
"""


@pytest.mark.skipif(not engine.COMPILED, reason="there is no cache without a compiler")
def test_an_edited_right_hand_side_outside_the_package_is_noticed(tmp_path):
    """The integrator's own key does not see the file of the problem."""
    for sign, answer in (("1.0", "2.718282"), ("-1.0", "0.367879")):
        (tmp_path / "problem_of_test_engine.py").write_text(RATES.replace("SIGN", sign))
        assert in_a_process(PROBLEM.replace("FOLDER", repr(str(tmp_path)))) == [answer]


class Nested(NamedTuple):
    number: float
    arrays: tuple


@kernel
def twice_without_reference_counts(nested):
    nested = without_reference_counts(nested)
    for array in nested.arrays:
        array[0] *= 2.0
    return nested.number + nested.arrays[1][0]


def test_arrays_without_reference_counts_share_memory_and_spare_their_owners():
    first, second = np.ones(3), np.full(2, 5.0)
    counts = sys.getrefcount(first), sys.getrefcount(second)
    for _ in range(100):
        twice_without_reference_counts(Nested(0.5, (first, second)))
        first[0], second[0] = 1.0, 5.0
    assert twice_without_reference_counts(Nested(0.5, (first, second))) == 10.5
    assert (first[0], second[0]) == (2.0, 10.0)
    assert (sys.getrefcount(first), sys.getrefcount(second)) == counts


SIGNATURE = numba.types.float64(numba.types.float64, numba.types.float64[::1])
call = caller(SIGNATURE)


@kernel
def adding(x, cells):
    cells[0] += x
    return cells[0]


@kernel
def multiplying(x, cells):
    cells[0] *= x
    return cells[0]


@kernel
def call_twice(function, x, cells):
    return call(function, x, cells) + call(function, x + 1.0, cells)


@kernel
def call_all(functions, cells):
    for k in range(functions.shape[0]):
        call(functions[k], 3.0, cells)


WITH_ADDRESSES = pytest.mark.skipif(
    not engine.COMPILED, reason="without a compiler functions have no address"
)


@WITH_ADDRESSES
def test_function_called_by_address_lets_callers_compile_only_once():
    for function, total, left in ((adding, 7.0 + 10.0, 10.0), (multiplying, 10.0 + 30.0, 30.0)):
        cells = np.array([5.0])
        assert call_twice(code_address(function, SIGNATURE), 2.0, cells) == total
        assert cells.tolist() == [left]
    assert len(call_twice.signatures) == 1


@WITH_ADDRESSES
def test_addresses_may_stand_in_an_array():
    cells = np.array([5.0])
    order = [code_address(f, SIGNATURE) for f in (adding, multiplying, adding)]
    call_all(np.array(order), cells)
    assert cells.tolist() == [27.0]


@WITH_ADDRESSES
def test_an_address_is_that_of_one_function():
    assert code_address(adding, SIGNATURE) == code_address(adding, SIGNATURE)
    assert code_address(adding, SIGNATURE) != code_address(multiplying, SIGNATURE)


def test_plain_function_in_place_of_an_address_is_called_directly():
    cells = np.array([5.0])
    assert call(lambda x, cells: cells[0] - x, 2.0, cells) == 3.0
    plain = getattr(call_twice, "py_func", call_twice)
    assert plain(lambda x, cells: x * cells[0], 2.0, cells) == 25.0


@WITH_ADDRESSES
def test_call_by_address_allocates_nothing_and_leaves_array_owners_alone():
    cells = np.array([1.0])
    address, count = code_address(multiplying, SIGNATURE), sys.getrefcount(cells)
    for _ in range(100):
        call_twice(address, 0.0, cells)
    assert sys.getrefcount(cells) == count


BY_ADDRESS = """
import sys
import numpy as np
sys.path.insert(0, FOLDER)
from called_in_test_engine import SIGNATURE, adding, call_twice
from torquer.compile.numba_private import code_address
print(call_twice(code_address(adding, SIGNATURE), 2.0, np.array([5.0])))
print(sum(call_twice.stats.cache_hits.values()))
"""
CALLED = """
import numba
from torquer.compile.engine import caller, kernel

SIGNATURE = numba.types.float64(numba.types.float64, numba.types.float64[::1])
call = caller(SIGNATURE)

@kernel
def adding(x, cells):
    cells[0] += x
    return cells[0]

@kernel
def call_twice(function, x, cells):
    return call(function, x, cells) + call(function, x + 1.0, cells)
"""


@WITH_ADDRESSES
def test_later_process_finds_callers_by_address_in_the_cache(tmp_path):
    (tmp_path / "called_in_test_engine.py").write_text(CALLED)
    script = BY_ADDRESS.replace("FOLDER", repr(str(tmp_path)))
    here = {"TORQUER_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_DISABLE_JIT": "0"}
    assert in_a_process(script, **here) == ["17.0", "0"]
    assert in_a_process(script, **here) == ["17.0", "1"]
