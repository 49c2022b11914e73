"""Symbolic links that others left in an output folder lead no output elsewhere."""

import os

import pytest

from torquer.base.folder_lock import claim
from torquer.base.replaced_files import replacing
from torquer.cli.output import make_writable
from torquer.simulation.results.file import own_folder, put

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links need rights there")


@pytest.fixture
def planted(tmp_path):
    """`planted(name)`: a link of that name in a folder, and the file elsewhere that it leads to."""
    (tmp_path / "out").mkdir()
    precious = tmp_path / "precious"

    def plant(name):
        precious.write_text("precious")
        link = tmp_path / "out" / name
        link.unlink(missing_ok=True)
        link.symlink_to(precious)
        return link, precious

    return plant


@pytest.mark.parametrize("name", ["summary.json", "summary.json.part"])
def test_a_file_takes_the_place_of_a_link(planted, name):
    link, precious = planted(name)
    path = put(link.with_name("summary.json"), "{}")
    assert path.read_text() == "{}" and not path.is_symlink()
    assert precious.read_text() == "precious"
    assert [each.name for each in path.parent.iterdir()] == ["summary.json"]


def test_what_is_written_in_parts_is_a_new_file(planted):
    link, precious = planted("result.nc.part")
    with replacing(link.with_name("result.nc")) as path, path.open("r+b") as file:
        file.write(b"new")
    assert precious.read_text() == "precious"
    assert link.with_name("result.nc").read_bytes() == b"new"


def test_no_output_file_is_written_through_a_link(planted):
    for name in (".writable", ".claimed"):
        link, precious = planted(name)
        precious.unlink()  # what is not there would be made
        make_writable(link.parent)
        with claim(link.parent):
            pass
        assert not precious.exists() and not link.is_symlink()


def test_a_folder_that_is_a_link_is_refused(tmp_path):
    (tmp_path / "plots").symlink_to(tmp_path, target_is_directory=True)
    with pytest.raises(OSError, match="plots is a symbolic link"):
        own_folder(tmp_path / "plots")
    assert own_folder(tmp_path / "new" / "plots").is_dir()


def test_pictures_are_not_removed_from_another_folder(call, scenario, tmp_path):
    """Nor drawn there."""
    out, others = tmp_path / "out", tmp_path / "others"
    out.mkdir()
    others.mkdir()
    (others / "mine.png").write_bytes(b"old")
    os.utime(others / "mine.png", (0, 0))
    (out / "plots").symlink_to(others, target_is_directory=True)
    (out / "report.html").symlink_to(others / "mine.png")
    code, _, err = call("run", scenario, "--out", out, "--plots")
    assert (code, err) == (2, (
        f"error: --out: must be a folder that can be written; received {out} "
        "(plots is a symbolic link)\n"
    ))  # fmt: skip
    assert call("run", scenario, "--out", out)[0] == 0
    assert not (out / "report.html").is_symlink()
    assert [(each.name, each.read_bytes()) for each in others.iterdir()] == [("mine.png", b"old")]
