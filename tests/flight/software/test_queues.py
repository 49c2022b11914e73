"""Bounded queues: what goes in comes out in order, and what is lost is counted and reported."""

import copy

import pytest
from hypothesis import given, strategies as st

from torquer.flight.software.queues import Cdh

ACTIONS = st.lists(st.sampled_from(["put", "take", "newest", "dropped"]))


@given(st.integers(3, 10), ACTIONS)
def test_a_queue_keeps_the_newest_elements_in_order(size, actions):
    cdh, kept, lost, last = Cdh({"state": size, "acks": 3}), [], 0, None
    for number, action in enumerate(actions):
        if action == "put":
            full = len(kept) == size
            assert cdh.put("state", number) is not full
            if full:
                last, lost = kept.pop(0), lost + 1
            kept.append(number)
        elif action == "take":
            assert cdh.take("state") == (kept.pop(0) if kept else None)
        elif action == "newest":
            assert cdh.newest("state") == (kept[-1] if kept else None)
        elif action == "dropped":
            assert cdh.take_dropped("state") == last
            last = None
        assert list(cdh.queues["state"]) == kept
    assert cdh.dropped == {"state": lost, "acks": 0}
    assert list(cdh.queues["acks"]) == []


@pytest.mark.verifies("REQ-CDH-002")
def test_sender_to_full_queue_learns_which_element_was_dropped():
    cdh = Cdh({"svr": 3})
    assert [cdh.put("svr", name) for name in "abcde"] == [True, True, True, False, False]
    assert cdh.take_dropped("svr") == "b"
    assert cdh.take_dropped("svr") is None
    assert list(cdh.queues["svr"]) == ["c", "d", "e"]
    assert cdh.dropped["svr"] == 2


def test_a_copy_has_a_life_of_its_own():
    cdh = Cdh({"svr": 3})
    cdh.put("svr", 1)
    other = copy.deepcopy(cdh)
    for number in range(3):
        other.put("svr", number)
    assert (list(cdh.queues["svr"]), cdh.dropped["svr"]) == ([1], 0)
    assert (list(other.queues["svr"]), other.dropped["svr"]) == ([0, 1, 2], 1)


@pytest.mark.verifies("REQ-CDH-001")
@pytest.mark.parametrize("size", [0, 2, 11])
def test_a_queue_holds_three_to_ten_elements(size):
    with pytest.raises(ValueError, match=f"^acks: .* 3 to 10 elements; received {size}$"):
        Cdh({"svr": 3, "acks": size})


def test_a_queue_that_is_not_there_is_a_mistake():
    with pytest.raises(KeyError):
        Cdh({"svr": 3}).put("stb", 1)
