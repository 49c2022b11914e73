"""Small files that claim to be large, or that name others: refused before anything is read."""

import hashlib
import io

import h5py
import numpy as np
import pytest
import xarray as xr
from messages import message_of

import torquer
from torquer.simulation.results import file as files

TEXT = h5py.string_dtype()


def edited(content, change):
    """The content of an HDF5 file with something changed in it."""
    kept = io.BytesIO(content)
    with h5py.File(kept, "r+") as file:
        change(file)
    return kept.getvalue()


def one_text_many_times(content):
    """An array of 100 000 texts, all of which stand at one place: 0.1 TB."""

    def change(file):
        texts = file.create_dataset("bomb", (100_000,), TEXT)
        texts[:], texts[0] = "short", "x" * 1_000_000

    content = edited(content, change)
    with h5py.File(io.BytesIO(content)) as file:
        at = file["bomb"].id.get_offset()
    return content[:at] + content[at : at + 16] * 100_000 + content[at + 1_600_000 :]


def of_others(file, path="/etc/hostname"):
    file.create_dataset("bomb", (10,), "u1", external=[(path, 0, 10)])


def virtual(file):
    layout = h5py.VirtualLayout((10**12,), "f8")
    layout[:1] = h5py.VirtualSource("elsewhere.nc", "time", shape=(1,))
    file.create_virtual_dataset("bomb", layout)


def nested(file):
    group = file
    for _ in range(1000):
        group = group.create_group("bomb")


def array(shape, kind="f8", **how):
    return lambda file: file.create_dataset("bomb", shape, kind, **how)


LARGE = r"'bomb' claims more than 100 times its bytes$"
OTHER = "'bomb' holds neither numbers nor texts$"
BOMBS = {
    "never written": (array((10**12,)), LARGE),
    "never written, in pieces": (array((10**12,), chunks=(4096,)), LARGE),
    "never written, of many axes": (array((10**4,) * 3), LARGE),
    "zeros, compressed": (array((10**7,), data=np.zeros(10**7), compression="gzip"), LARGE),
    "one piece": (array((9,), maxshape=(None,), chunks=(10**8,), compression="gzip"), LARGE),
    "texts never written": (array((10**12,), TEXT), LARGE),
    "lists of numbers": (array((3,), h5py.vlen_dtype("f8")), OTHER),
    "records": (array((3,), np.dtype([("a", "f8"), ("b", "i4")])), OTHER),
    "references": (array((3,), h5py.ref_dtype), OTHER),
    "nothing": (array(None, data=h5py.Empty("f8")), "'bomb' is no array$"),
    "groups in groups": (nested, "'bomb' is no array$"),
    "itself": (lambda file: file.update(bomb=file["/"]), "'bomb' is no array$"),
    "a link": (lambda file: file.update(bomb=h5py.SoftLink("/time")), "'bomb' is a link$"),
    "another file": (lambda f: f.update(bomb=h5py.ExternalLink("x.nc", "/t")), "is a link$"),
    "bytes of another file": (of_others, "'bomb' stands in other files$"),
    "parts of other files": (virtual, "'bomb' stands in other files$"),
    "texts of an attribute": (
        lambda file: file.attrs.create("bomb", ["x"] * 1000, dtype=TEXT),
        "'bomb' is a list of 1000 texts$",
    ),
}


@pytest.fixture(scope="module")
def result():
    """A small dataset with numbers and texts."""
    variables = {"a": ("time", np.arange(9.0)), "how": ("time", np.array(["complete"] * 9))}
    return xr.Dataset(variables, {"time": np.arange(9.0)}, {"scenario": "{}", "laws": ["a", "b"]})


def sealed(content):
    """The content of a file with the digest that whoever edits it can compute, too."""
    return content + files._SEAL + hashlib.sha256(content).hexdigest().encode()


def content_of(result, tmp_path):
    torquer.save(result, tmp_path / "sound.nc")
    return (tmp_path / "sound.nc").read_bytes()[: -files._SEAL_BYTES]


@pytest.mark.parametrize("name", [*BOMBS, "one text many times"])
def test_what_cannot_stand_in_a_file_is_not_read(result, name, tmp_path, monkeypatch):
    path, content = tmp_path / "result.nc", content_of(result, tmp_path)
    change, message = BOMBS.get(name, (None, LARGE))
    path.write_bytes(sealed(edited(content, change) if change else one_text_many_times(content)))

    def not_yet(*given, **how):
        raise AssertionError("read before it was looked at")

    monkeypatch.setattr(xr, "open_dataset", not_yet)
    monkeypatch.setattr(xr, "load_dataset", not_yet)
    for read in (files.load, files.lazily, torquer.resume):
        text = message_of(read, path)
        assert text.startswith("result: must hold numbers and texts as torquer writes them; ")
        with pytest.raises(ValueError, match=message):
            read(path)


def test_what_was_saved_is_read_whatever_it_is(result, tmp_path):
    """Also compressed, in pieces, with texts of all lengths, without rows."""
    path = tmp_path / "result.nc"
    noisy = result.assign(a=("time", np.random.default_rng(1).normal(size=9)))
    long = result.assign(how=("time", np.array(["x" * 10**k for k in range(6)] + ["", "é", "中"])))
    packed = {"encoding": {"a": {"zlib": True, "chunksizes": (4,)}}, "unlimited_dims": ["time"]}
    for each in (noisy, long, result.isel(time=slice(0)), result[["how"]]):
        for how in (None, packed if "a" in each and each.sizes["time"] else {}):
            files.save(each, path, how)
            assert files.load(path).identical(each)
            with files.lazily(path) as read:
                assert read.load().identical(each)


def test_a_pipe_or_a_device_is_no_result(tmp_path):
    for path in ("/dev/zero", "/dev/null"):
        assert message_of(files.load, path) == f"result: must be a file; received {path}"


def test_commands_refuse_in_one_line(call, result, tmp_path):
    content = content_of(result, tmp_path)
    for k in range(2):
        (tmp_path / f"run{k}").mkdir()
        bomb = edited(content, BOMBS["never written"][0])
        (tmp_path / f"run{k}" / "result.nc").write_bytes(sealed(bomb))
        (tmp_path / f"run{k}" / "campaign.nc").write_bytes(sealed(bomb))
    runs = tmp_path / "run0", tmp_path / "run1"
    for command in (["compare"], ["campaign", "compare"]):
        code, out, err = call(*command, *runs)
        assert (code, out) == (2, "") and err.count("\n") == 1
        assert "claims more than 100 times its bytes" in err
