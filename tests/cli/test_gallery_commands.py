"""`torquer gallery`: lists, runs, exit codes, one line per mistake."""

import os
import subprocess
import sys

import pytest

from gallery.catalogue import LEFT_OUT, ROW_OF
from gallery.drawing import new_figure
from gallery.entry import Answer, Entry, Grade, Outcome, Verdict, near
from gallery.pages import record_of, write_pages

DIFFERS = {"declared": Verdict.DIFFERS, "reason": "so", "grade": Grade.OPEN}


def make(measured, **keys):
    return Entry(
        ids=("FIELD-10",),
        compute=lambda: Answer(
            (near("x", "2.7", measured, "%"),), {"": new_figure("A title")[0]}, "a note"
        ),
        **keys,
    )


@pytest.fixture
def only(monkeypatch):
    """`only(entry)`: the gallery holds just this entry."""

    def hold(entry):
        monkeypatch.setattr("gallery.lookup.all_entries", lambda: [entry])

    return hold


def test_list_has_every_id_and_says_what_is_not_yet(call, strict_json, only):
    only(make(2.7))
    code, out, err = call("gallery", "list")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[-1] == f"1 of {len(ROW_OF)} done, {len(LEFT_OUT)} left out"
    rows, omitted = lines[: len(ROW_OF)], lines[len(ROW_OF) : -1]
    assert [line.split()[0] for line in rows] == list(ROW_OF)
    (done,) = [line for line in rows if "not yet" not in line]
    assert done.split()[:2] == ["FIELD-10", "agrees"]
    assert [line.split()[0] for line in omitted] == [one.source for one in LEFT_OUT]
    assert all("left out" in line for line in omitted)
    answer = strict_json(call("gallery", "list", "--json")[1])
    assert [row["id"] for row in answer] == list(ROW_OF)
    assert {row["verdict"] for row in answer} == {"agrees", "not yet"}
    assert set(answer[0]) == {"id", "verdict", "grade", "content", "expected"}
    assert {row["grade"] for row in answer} == {None}


def test_list_has_the_grade_of_what_differs(call, strict_json, only):
    only(make(3.0, **DIFFERS))
    assert "FIELD-10        differs (left open)  Accuracy" in call("gallery", "list")[1]
    answer = strict_json(call("gallery", "list", "--json")[1])
    assert [row["grade"] for row in answer if row["id"] == "FIELD-10"] == ["left open"]


@pytest.mark.parametrize("command", [("run", "FIELD-10"), ("all",)])
def test_json_per_entry_and_pictures(call, strict_json, only, tmp_path, command):
    only(make(2.72))
    code, out, err = call("gallery", *command, "--json", "--out", tmp_path / "made" / "here")
    assert (code, err) == (0, "")
    (data,) = strict_json(out)
    assert data["id"] == "FIELD-10" and data["verdict"] == "agrees"
    (check,) = data["checks"]
    assert (check["expected"], check["measured"]) == ("2.7 %", 2.72)
    assert check["tolerance"] == pytest.approx([2.65, 2.75])
    assert data["note"] == "a note"
    picture = tmp_path / "made" / "here" / "FIELD-10.png"
    assert data["pictures"] == [str(picture)] and picture.stat().st_size > 5000


def test_text_and_the_default_folder(call, only, tmp_path, monkeypatch):
    only(make(3.0, **DIFFERS))
    monkeypatch.chdir(tmp_path)
    code, out, err = call("gallery", "run", "field-10")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "FIELD-10: Accuracy with disturbances, without/with wheel: differs (left open)",
        "  x: 3 %; printed: 2.7 % (agrees if 2.65 to 2.75): DIFFERS (left open)",
        "  why: so",
        "runs/gallery: results.json, 1 pictures",
    ]
    assert (tmp_path / "runs/gallery/FIELD-10.png").is_file()


@pytest.mark.parametrize(
    ("measured", "keys", "words"),
    [
        (3.0, {}, "'agrees'; received 'differs'"),
        (2.7, DIFFERS, "'differs (left open)'; received 'agrees'"),
    ],
)
def test_exit_1_if_a_verdict_is_not_the_declared_one(call, only, tmp_path, measured, keys, words):
    only(make(measured, **keys))
    code, _, err = call("gallery", "all", "--out", tmp_path)
    assert code == 1
    assert err == f"error: gallery FIELD-10: must have its declared verdict, {words}\n"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("run", "FIELD-33"), "gallery: must be an id of the catalogue; received 'FIELD-33'; near "
         "it: FIELD-3, FIELD-8, FIELD-6"),
        (("run", "FIELD-10", "MGS-12"), "gallery: must be an entry that is done; received MGS-12, "
         "which is not yet; see: gallery list"),
        (("run",), "gallery run: must name at least one id (see `gallery list`); received none"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_and_exit_2(call, only, arguments, line):
    only(make(2.7))
    code, out, err = call("gallery", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {line.split('near it')[0]}") and err.count("\n") == 1
    if "near it" in line:
        assert "; near it: FIELD-3" in err


@pytest.mark.parametrize("option", ["--out", "--docs"])
def test_a_folder_that_cannot_be_made(call, only, tmp_path, option):
    only(make(2.7))
    (tmp_path / "in_the_way").write_text("")
    spare = [] if option == "--out" else ["--out", tmp_path / "out"]
    code, out, err = call("gallery", "all", option, tmp_path / "in_the_way" / "x", *spare)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {option}: must be a folder that can be written; received ")
    assert err.count("\n") == 1


def test_docs_are_written_if_asked(call, only, tmp_path):
    only(make(2.7))
    docs = tmp_path / "docs"
    code, _, err = call("gallery", "all", "--out", tmp_path / "out", "--docs", docs)
    assert (code, err) == (0, "")
    assert {path.name for path in docs.glob("*.md")} >= {"FIELD.md", "differences.md"}
    assert (docs / "img" / "FIELD-10.png").is_file()


def test_single_entry_is_written_into_the_existing_pages(call, only, tmp_path):
    docs = tmp_path / "docs"
    other = Entry(ids=("MAG-2.2",), compute=make(2.7).compute)
    write_pages(record_of([Outcome(other, other.compute())]), docs_made(docs))
    only(make(2.7))
    call_it = ("gallery", "run", "FIELD-10", "--out", tmp_path / "out", "--docs", docs)
    assert call(*call_it)[0] == 0
    assert "a note" in (docs / "FIELD.md").read_text(encoding="utf-8")
    assert "## MAG-2.2" in (docs / "MAG.md").read_text(encoding="utf-8")
    assert (docs / "img" / "FIELD-10.png").is_file()


def docs_made(folder):
    (folder / "img").mkdir(parents=True)
    return folder


def test_every_gallery_command_has_help(call):
    for name in ("list", "run", "all"):
        code, out, err = call("gallery", name, "--help")
        assert (code or 0, err) == (0, "")
        assert f"torquer gallery {name}" in out


@pytest.mark.skipif(os.name == "nt", reason="needs a pseudo-terminal")
def test_a_bar_on_a_terminal_and_quiet_in_a_pipe(call, tmp_path):
    import pty

    arguments = ["gallery", "run", "MAG-1.2.4", "--json", "--out", str(tmp_path)]
    code, _, err = call(*arguments)
    assert (code, err) == (0, "")
    command = [sys.executable, "-m", "torquer", *arguments]
    ours, theirs = pty.openpty()
    subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, check=True)
    os.close(theirs)
    assert b"MAG-1.2.4" in os.read(ours, 65536)
    os.close(ours)


@pytest.mark.skipif(os.name == "nt", reason="names of files are of another kind")
def test_a_folder_whose_name_is_no_text(call, only, tmp_path, strict_json):
    only(make(2.72))
    out = tmp_path / "caf\udce9"
    code, answer, err = call("gallery", "run", "FIELD-10", "--json", "--out", out)
    assert (code, err) == (0, "") and answer.isascii()
    assert strict_json(answer) == strict_json((out / "results.json").read_text(encoding="utf-8"))


def test_without_a_checkout_one_line_says_what_is_missing(call, monkeypatch, tmp_path):
    monkeypatch.setattr("torquer.cli.commands.gallery.CHECKOUT", tmp_path)
    for command in (("list",), ("run", "FIELD-10"), ("all",)):
        assert call("gallery", *command) == (2, "", (
            "error: gallery: must stand next to the package, as in a checkout with "
            "`pip install -e .`; received an installed package\n"
        ))  # fmt: skip


NO_SYMPY = """
import sys
sys.modules["sympy"] = None
from torquer.cli import main
main(sys.argv[1:])
"""


def test_only_the_entries_that_derive_in_symbols_need_sympy():
    listed, computed = (
        subprocess.run(
            [sys.executable, "-c", NO_SYMPY, "gallery", *words], capture_output=True, text=True
        )
        for words in (("list",), ("run", "MGS-12"))
    )
    assert (listed.returncode, listed.stderr) == (0, "")
    assert "MGS-12" in listed.stdout
    assert computed.returncode == 2
    assert computed.stderr.startswith("error: gallery: needs sympy for this entry: pip install")
