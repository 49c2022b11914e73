"""Key files: nobody but the owner may touch them."""

import os

import pytest

from torquer.flight.packets.keys import new_key, read_key

POSIX = pytest.mark.skipif(os.name != "posix", reason="rights of POSIX")


def test_a_new_key_is_read_again_and_not_replaced(tmp_path):
    key = new_key(tmp_path / "up.key")
    assert len(key) == 32 and read_key(tmp_path / "up.key") == key
    assert new_key(tmp_path / "down.key") != key
    with pytest.raises(FileExistsError):
        new_key(tmp_path / "up.key")


@POSIX
def test_a_new_key_is_private_whatever_the_mask(tmp_path):
    before = os.umask(0)
    try:
        new_key(tmp_path / "up.key")
    finally:
        os.umask(before)
    assert (tmp_path / "up.key").stat().st_mode & 0o777 == 0o600


@pytest.mark.verifies("REQ-LNK-004")
@POSIX
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o610, 0o601, 0o777])
def test_a_key_that_others_may_touch_is_refused(tmp_path, mode):
    path = tmp_path / "up.key"
    new_key(path)
    path.chmod(mode)
    expected = f"^key: {path} must be .* its owner only \\(chmod 600\\); received mode {mode:o}$"
    with pytest.raises(ValueError, match=expected):
        read_key(path)
    path.chmod(0o400)
    assert len(read_key(path)) == 32


@pytest.mark.parametrize(("size", "received"), [(0, 0), (31, 31), (33, "more"), (64, "more")])
def test_a_key_of_another_size_is_refused(tmp_path, size, received):
    path = tmp_path / "up.key"
    path.write_bytes(bytes(size))
    path.chmod(0o600)
    with pytest.raises(ValueError, match=f"^key: {path} must have 32 bytes; received {received}$"):
        read_key(path)


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^key: .*none must be a file; No such file"):
        read_key(tmp_path / "none")
    with pytest.raises(ValueError, match=r"^key: .* must be a file; received something else$"):
        read_key(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    with pytest.raises(ValueError, match=r"^key: .* must be a file; received something else$"):
        read_key(tmp_path / "pipe")
