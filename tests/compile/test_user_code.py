"""Compiled code of users' functions: found wherever their file stands, and never that of others."""

import json
import os
import subprocess
import sys
import uuid
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.base.user_source import cache_beside, import_file
from torquer.compile import engine
from torquer.compile.references import References

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")

ENGINE = "from torquer.compile.engine import kernel\n"
RUN = uuid.uuid4()
LAW = "def law(x):\n    return 2.0 * x + 1.0\n"
#: Too long to become part of what calls it: it keeps a symbol of its own.
LONG = "\n".join(
    f"    for i in range(n):\n        s = math.sin(s + {k}) + math.cos(s) * i" for k in range(12)
)
CALLER = "from helper import helper\ndef law(x):\n    return helper(x, 3) + helper(x + 1, 4)\n"
HELPER = f"""import math
from torquer.compile.engine import called
@called
def helper(x, n):
    s = x
{LONG}
    return GAIN + 0 * s
"""
#: Compiles the law of each folder that is named; prints what it gives at 1 and what was found.
SCRIPT = """
import json, sys
from tests.compile.test_user_code import compiled
made = [compiled(folder) for folder in sys.argv[1:]]
print(json.dumps([(law(1.0), sum(law.stats.cache_hits.values())) for law in made]))
"""


@pytest.fixture(autouse=True)
def every_edit_is_read(monkeypatch):
    """Python takes a file of the same size and second for the one that it has read before."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)


def write(folder: Path, **texts: str) -> Path:
    """A folder with files of these names, which no test before has compiled."""
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(f"{text}# {folder.parent} {RUN}\n")
    return folder


def compiled(folder):
    """The law of a folder, compiled as blocks of scenarios are."""
    from numba import types

    from torquer.computer.blocks.plugin import compile_plugin

    file = Path(folder) / "law.py"
    law = import_file(file, "law").law
    with cache_beside(file):
        return compile_plugin(law, (types.float64,), "law", keep=True, error_model="numpy")


def found(law) -> int:
    """How often compiled code was found on the disk."""
    return sum(law.stats.cache_hits.values())


def compiled_in_a_process(*folders: Path) -> list:
    """Results at 1, and how often code was found, of the laws of folders, in a new process."""
    here = Path(torquer.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *map(str, folders)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": f"{here}{os.pathsep}{here / 'tests'}"},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_file_in_two_folders_is_compiled_once(tmp_path):
    first, second = (compiled(write(tmp_path / name, law=LAW)) for name in "ab")
    assert (found(first), found(second)) == (0, 1)
    assert first(3.0) == second(3.0) == 7.0


@pytest.mark.parametrize("old, new", [("2.0", "4.0"), ("+ 1.0", "+ 2.0"), ("x + ", "x - ")])
def test_what_is_edited_is_compiled_again(tmp_path, old, new):
    texts = LAW, LAW.replace(old, new)
    made = [compiled(write(tmp_path / "a", law=text)) for text in (*texts, *texts)]
    expected = [eval(text.split("return ")[1], {"x": 3.0}) for text in texts]
    assert [law(3.0) for law in made] == expected * 2
    assert [found(law) for law in made] == [0, 0, 1, 1]


def test_files_of_the_same_names_in_two_folders_are_kept_apart(tmp_path):
    law = "from helper import gain\nHERE = gain()\ndef law(x):\n    return HERE * x\n"
    made = [
        compiled(write(tmp_path / name, law=law, helper=f"def gain():\n    return {gain}\n"))
        for name, gain in (("a", 2.0), ("b", 3.0))
    ]
    assert [law(1.0) for law in made] == [2.0, 3.0]


@pytest.mark.parametrize(
    "law",
    [
        "HERE = float((Path(__file__).parent / 'table.csv').read_text())\n"
        "def law(x):\n    return HERE * x\n",
        "HERE = np.loadtxt(Path(__file__).parent / 'table.csv', ndmin=1)\n"
        "def law(x):\n    return HERE[0] * x\n",
        "HERE = float((Path(__file__).parent / 'table.csv').read_text())\n"
        "@kernel\ndef inner(x):\n    return HERE * x\n"
        "def law(x):\n    return inner(x)\n",
    ],
    ids=["number", "array", "in a kernel"],
)
def test_equal_files_that_read_other_numbers_are_kept_apart(tmp_path, law):
    law = f"from pathlib import Path\nimport numpy as np\n{ENGINE}{law}"
    folders = [write(tmp_path / name, law=law) for name in "ab"]
    for folder, gain in zip((*folders, *folders), (2.0, 3.0, 4.0, 3.0), strict=True):
        (folder / "table.csv").write_text(str(gain))
        assert compiled(folder)(1.0) == gain


def test_what_a_file_imports_from_elsewhere_counts(tmp_path, monkeypatch):
    shared = write(tmp_path / "shared")
    monkeypatch.syspath_prepend(str(shared))
    folder = write(
        tmp_path / "laws",
        law="import shared_by_laws as s\ndef law(x):\n    return s.gain(x) + s.BIAS\n",
    )
    for gain, bias in ((2.0, 0.0), (2.0, 1.0), (3.0, 1.0)):
        write(
            shared,
            shared_by_laws=f"{ENGINE}@kernel\ndef gain(x):\n    return {gain} * x\nBIAS = {bias}\n",
        )
        assert compiled(folder)(1.0) == gain + bias
        del sys.modules["shared_by_laws"]


def test_a_helper_next_to_the_law_is_that_of_its_folder_and_of_now(tmp_path):
    """Code of one name from two processes, loaded in one: the linker takes what it has first."""
    folders = [
        write(tmp_path / name, law=CALLER, helper=HELPER.replace("GAIN", gain))
        for name, gain in (("a", "2.0"), ("b", "3.0"))
    ]
    assert compiled_in_a_process(folders[0]) == [[4.0, 0]]
    assert compiled_in_a_process(folders[1], folders[0]) == [[6.0, 0], [4.0, 1]]


def marks(*texts: str) -> list[str]:
    """Marks of the function `law` of each text."""
    found = []
    for text in texts:
        scope = {"np": np, "kernel": engine.kernel, "__name__": "laws"}
        exec(compile(text, "laws.py", "exec"), scope)
        found.append(References(scope["law"]).mark)
    return found


@pytest.mark.parametrize(
    "other",
    [
        "K = 2.5\ndef law(x):\n    return K * x",
        "K = 2\ndef law(x):\n    return K * x",
        "K = np.array([2.0])\ndef law(x):\n    return K * x",
        "K = 2.0\ndef law(x):\n    return K + x",
        "K = 2.0\ndef law(x):\n    return 1.0 * K * x",
        "K = 2.0\ndef law(x, y=1.0):\n    return K * x",
        "\nK = 2.0\ndef law(x):\n    return K * x",
        "K = 2.0\ndef helper(x):\n    return K * x\ndef law(x):\n    return helper(x)",
    ],
)
def test_a_mark_is_of_all_that_a_function_is_made_of(other):
    text = "K = 2.0\ndef law(x):\n    return K * x"
    same, again, changed = marks(text, text, other)
    assert same == again != changed


def test_a_mark_is_of_functions_that_call_each_other():
    text = (
        "@kernel\ndef odd(n):\n    return n > 0 and even(n - 1)\n"
        "@kernel\ndef even(n):\n    return n == 0 or odd(n - K)\n"
        "K = {}\ndef law(n):\n    return odd(n)"
    )
    first, again, other = marks(text.format(1), text.format(1), text.format(2))
    assert first == again != other


def test_what_nothing_describes_is_of_one_file_alone():
    text = "K = object()\ndef law(x):\n    return K"
    scopes = [{}, {}, {}]
    for scope, name in zip(scopes, ("a.py", "a.py", "b.py"), strict=True):
        exec(compile(text, name, "exec"), scope)
    first, again, elsewhere = (References(scope["law"]).mark for scope in scopes)
    assert first == again != elsewhere
