"""Where the functions of an export come from, and what the recorded flight reaches of them."""

import ast
import csv
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from flight.c99.test_export import EXAMPLES
from flight_requirements import requirements

import torquer
from torquer.compile.sources import PACKAGE
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import export_c, make_texts
from torquer.flight.c99.trace import HEAD, OF_EXPORT, trace_table

MISSING = [each for each in ("cc", "gcov") if not shutil.which(each)]
needs_gcov = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
LAW = '''
import torquer


@torquer.law
def damp(inputs, parameters, memory):
    """Damps the rate, by the
    first reading's number alone.
    Source: none.

    Meets REQ-SAT-012 and REQ-AOCS-3.
    """
    return (3e4 * inputs.b_body_t[0], 0.0, 0.0)
'''


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.fixture(scope="module")
def texts(tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """The folder of a user's law, and the texts of its export."""
    folder = tmp_path_factory.mktemp("traced")
    (folder / "my_law.py").write_text(LAW)
    scenario = (EXAMPLES / "my_law.toml").read_text().replace("transverse_bdot", "damp")
    (folder / "damp.toml").write_text(scenario.replace("parameters = { gain = 3e4 }", ""))
    computer = find_computer(torquer.load_scenario(folder / "damp.toml"))
    return folder, make_texts(computer, translate_step(computer, again=0), 1)


def test_every_function_is_in_the_table_once(texts):
    _, made = texts
    rows = rows_of(made["TRACE.csv"])
    assert tuple(rows[0]) == HEAD
    for file in ("adcs.c", "adcs_tables.c", "adcs_math.c"):
        names = [each["function"] for each in rows if each["file"] == file]
        bodies = re.findall(r"(\w+)\([^;{}]*\)\n\{$", made[file], flags=re.M)
        assert names == bodies and len(set(names)) == len(names) > 3


def test_the_comment_of_a_function_has_whole_sentences_of_its_docstring(texts):
    """All of the first paragraph, however many lines it has."""
    folder, made = texts
    found = 0
    for each in rows_of(made["TRACE.csv"]):
        name = each["source"]
        if name == OF_EXPORT:
            continue
        file = PACKAGE.parent / name if name.startswith("torquer/") else folder / name
        lines = file.read_text().splitlines()
        own = lines[int(each["first_line"]) - 1 : int(each["last_line"])]
        said = ast.get_docstring(ast.parse(textwrap.dedent("\n".join(own))).body[0]) or ""
        first = [row for row in said.partition("\n\n")[0].splitlines() if row[:8] != "Source: "]
        at = re.search(
            rf"/\* ((?:(?!\*/).)*)\*/\n[^\n]*\b{each['function']}\(", made[each["file"]], re.S
        )
        comment = at[1].replace("\n   ", "\n") if at else ""
        assert comment.startswith("\n".join(first).replace("*/", "* /")), each
        assert not first or first[-1].endswith("."), each
        found += len(first) > 1
    assert found > 1


def test_a_digest_is_that_of_the_lines_it_names(texts):
    folder, made = texts
    rows = [each for each in rows_of(made["TRACE.csv"]) if each["source"] != OF_EXPORT]
    assert len(rows) > 50
    for each in rows:
        name = each["source"]
        file = PACKAGE.parent / name if name.startswith("torquer/") else folder / name
        lines = file.read_bytes().splitlines(keepends=True)
        own = lines[int(each["first_line"]) - 1 : int(each["last_line"])]
        assert hashlib.sha256(b"".join(own)).hexdigest().startswith(each["sha256"])
        (defined,) = [line for line in own if line.startswith(b"def ")]
        word = re.sub(r"_\d+$", "", each["function"])
        word = word.removeprefix("adcs_").removeprefix("own_")
        assert word in defined.decode() or b"adapter" in defined, each


def test_what_has_no_kernel_is_of_the_export(texts):
    _, made = texts
    rows = rows_of(made["TRACE.csv"])
    own = {each["function"] for each in rows if each["source"] == OF_EXPORT}
    assert {"adcs_step", "adcs_self_test", "adcs_init", "answered"} <= own
    assert "gated_step" not in own


def test_the_comment_names_place_digest_and_the_users_requirements(texts):
    _, made = texts
    (row,) = [each for each in rows_of(made["TRACE.csv"]) if each["function"] == "damp"]
    assert row["requirements"] == "REQ-SAT-012 REQ-AOCS-3"
    said = f"From my_law.py:5-13, SHA-256 {row['sha256']} */"
    assert f"Meets REQ-SAT-012, REQ-AOCS-3.\n   {said}\nstatic " in made["adcs.c"]


def test_a_name_on_several_lines_has_its_comment():
    row = "/* Damps.\n   From my_law.py:5-11, SHA-256 0123456789abcdef */\nstatic int damp(int a,\n"
    text = f"{row}    int b)\n{{\n    return a;\n}}\n"
    assert (
        trace_table({"a.c": text}).splitlines()[1] == "a.c,damp,my_law.py,5,11,0123456789abcdef,,"
    )


def test_kernels_name_requirements_that_there_are(texts):
    _, made = texts
    known = {each.number for each in requirements()}
    named = {
        number
        for each in rows_of(made["TRACE.csv"])
        if each["source"].startswith("torquer/")
        for number in each["requirements"].split()
    }
    assert {f"REQ-BRD-00{k}" for k in range(1, 6)} <= named <= known


def test_nothing_but_docstrings_of_kernels_names_requirements():
    text = (PACKAGE / "computer/gate.py").read_text()
    docs = [
        ast.get_docstring(each) or ""
        for each in ast.walk(ast.parse(text))
        if isinstance(each, ast.FunctionDef)
    ]
    assert text.count("REQ-") == sum(each.count("REQ-") for each in docs) > 5


@pytest.fixture(scope="module")
def export(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("covered")
    export_c(torquer.load_scenario(EXAMPLES / "my_law.toml"), folder, steps=50)
    return folder


def covered(folder: Path, **environment) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, folder / "test/coverage.py"], capture_output=True, text=True,
        env={**os.environ, **environment},
    )  # fmt: skip


def reported(folder: Path) -> dict[str, list[str]]:
    """Cells of the report by function."""
    text = (folder / "COVERAGE.md").read_text()
    rows = [
        line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| adcs")
    ]
    return {row[0].split(": ")[1]: row[1:] for row in rows}


def test_without_gcov_it_says_so_and_is_not_green(export, tmp_path):
    done = covered(export, PATH=str(tmp_path))
    assert (done.returncode, done.stdout) == (77, "skipped, nothing was measured: install gcc\n")


@needs_gcov
def test_the_report_says_what_the_flight_reaches(export):
    for _ in range(2):  # counters of an earlier run do not add up
        done = covered(export)
        assert done.returncode == 0, done.stderr
        rows = reported(export)
        source, met, lines, branches, _ = rows["gated_step"]
        assert source.startswith("torquer/computer/gate.py:")
        assert met == "REQ-BRD-001 REQ-BRD-005"
        (reached, count), (taken, of) = (map(int, each.split(" / ")) for each in (lines, branches))
        assert 0 < reached < count and 0 < taken < of  # the refused step is not flown
        assert rows["set_flag"][-1] == "never called" == rows["adcs_set_flag"][-1]
        assert rows["set_flag"][2].startswith("0 / ")
        assert rows["transverse_bdot"][0] == "my_law.py:11"
    text = (export / "COVERAGE.md").read_text()
    assert "50 control steps: the same bits in commands and state." in text
    traced = {each["function"] for each in rows_of((export / "TRACE.csv").read_text())
              if each["file"] != "adcs_math.c"}  # fmt: skip
    assert set(rows) == traced


@needs_gcov
def test_what_is_never_reached_is_listed_by_its_line(export, tmp_path):
    folder = shutil.copytree(export, tmp_path / "planted")
    text = (folder / "adcs.c").read_text()
    head = "    answer = answered(own, inputs);\n"
    assert head in text
    planted = f"{head}    if (answer.status == 12345) {{\n        return 77u;\n    }}\n"
    text = text.replace(head, planted)
    (folder / "adcs.c").write_text(text)
    assert covered(folder).returncode == 0
    line = 1 + text[: text.index("return 77u;")].count("\n")
    assert {line - 1, line} <= set(map(int, reported(folder)["adcs_step"][-1].split(", ")))


@needs_gcov
def test_a_flight_with_another_bit_is_not_measured(export, tmp_path):
    folder = shutil.copytree(export, tmp_path / "spoiled")
    text = (folder / "adcs_tables.c").read_text()
    (folder / "adcs_tables.c").write_text(text.replace("30000.0", "30000.000000000004"))
    done = covered(folder)
    assert done.returncode == 1 and "the first difference is at step" in done.stderr
