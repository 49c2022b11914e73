"""What scenarios share: a result is kept only as long as nothing that differs was read."""

import threading

import pytest

from torquer.base.shared import Sharing, of_all, shared
from torquer.base.spec import Spec


class Part(Spec):
    """A part with two numbers."""

    length_m: float = 1.0
    """Length."""
    mass_kg: float = 2.0
    """Mass."""


class Whole(Spec):
    """A whole with two parts."""

    part: Part = Part()
    """The part that differs."""
    others: tuple[Part, ...] = ()
    """Others of its class."""
    factor: float = 3.0
    """A number."""


calls: list = []


@shared
def length(whole):
    calls.append("length")
    return whole.part.length_m


@shared
def mass(whole):
    calls.append("mass")
    return whole.part.mass_kg * whole.factor


@shared
def both(whole):
    calls.append("both")
    return length(whole) + mass(whole)


@shared
def part_itself(whole):
    return whole.part


@shared
def part_in_a_table(whole):
    return {"parts": [(whole.part,)]}


@shared
def is_the_default(whole):
    return whole.part == Part()


@shared
def as_plain_data(whole):
    return whole.model_dump()


@shared
def as_text(whole):
    return whole.part.model_dump_json()


@shared
def keys_given(whole):
    return sorted(whole.part.model_fields_set)


@shared
def hashed(whole):
    return hash(whole.part)


@shared
def listed(whole):
    return [value for _, value in whole.part]


@shared
def as_dict(whole):
    return tuple(whole.part.__dict__.values())


@shared
def function_of(whole):
    part = whole.part
    return lambda: part


@shared
def times(whole, number):
    calls.append("times")
    return number * whole.factor


FUNCTIONS = [
    length, mass, both, part_itself, part_in_a_table, is_the_default, as_plain_data, as_text,
    keys_given, hashed, listed, as_dict,
]  # fmt: skip


@pytest.fixture(autouse=True)
def no_calls():
    calls.clear()


@pytest.fixture
def sharing():
    """What wholes share whose parts differ in length, of all functions."""
    made, first = Sharing({Whole: frozenset(), Part: frozenset({"length_m"})}, Whole), Whole()
    with made.learning():
        for function in FUNCTIONS:
            function(first)
        function_of(first)
        times(first, 2)
    calls.clear()
    return made


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda each: each.__name__)
def test_another_whole_has_its_own_numbers(sharing, function):
    other = Whole(part=Part(length_m=7.0))
    expected = function(other)
    with sharing.used():
        assert function(other) == expected


def test_a_function_that_holds_a_part_is_made_again(sharing):
    other = Whole(part=Part(length_m=7.0))
    with sharing.used():
        assert function_of(other)() is other.part


def test_what_reads_nothing_that_differs_is_not_called_again(sharing):
    other = Whole(part=Part(length_m=7.0))
    with sharing.used():
        assert (length(other), mass(other), both(other)) == (7.0, 6.0, 13.0)
    assert calls == ["length", "both", "length"]


def test_what_an_example_has_is_not_read_of_the_scenario(sharing):
    @of_all
    def length_of_an_example(factor):
        calls.append("example")
        return factor * Part().length_m

    @shared
    def twice_an_example(whole):
        calls.append("twice")
        return length_of_an_example(2.0)

    with sharing.learning():
        twice_an_example(Whole())
    with sharing.used():
        assert twice_an_example(Whole(part=Part(length_m=7.0))) == 2.0
    assert calls == ["twice", "example"]


def test_other_arguments_are_another_call(sharing):
    with sharing.used():
        assert times(Whole(), 2) == 6.0
        assert calls == []
        assert times(Whole(), 5) == 15.0
    assert calls == ["times"]


def test_of_two_of_a_class_nothing_is_kept():
    made = Sharing({Whole: frozenset(), Part: frozenset({"length_m"})}, Whole)
    one, other = Whole(factor=1.0), Whole(factor=5.0)
    with made.learning():
        mass(one), mass(other), mass(one)
    calls.clear()
    with made.used():
        assert (mass(one), mass(other)) == (2.0, 10.0)


def test_outside_nothing_is_shared_and_nothing_watched(sharing):
    assert mass(Whole(factor=10.0)) == 20.0
    assert "__getattribute__" not in vars(Part) | vars(Whole)


def test_an_error_while_learning_leaves_no_trace():
    made = Sharing({Part: frozenset({"length_m"})}, Whole)

    @shared
    def wrong(whole):
        raise ValueError(f"{whole.part.length_m}")

    with pytest.raises(ValueError, match=r"^1\.0$"), made.learning():
        wrong(Whole())
    assert "__getattribute__" not in vars(Part)
    with made.used(), pytest.raises(ValueError, match=r"^7\.0$"):
        wrong(Whole(part=Part(length_m=7.0)))


def test_what_other_threads_read_is_not_noted():
    made, whole = Sharing({Part: frozenset({"length_m"})}, Whole), Whole()

    @shared
    def waiting(whole):
        other = threading.Thread(target=lambda: whole.part.length_m)
        other.start()
        other.join()
        calls.append("waiting")
        return whole.factor

    with made.learning():
        waiting(whole)
    with made.used():
        waiting(whole)
    assert calls == ["waiting"]
