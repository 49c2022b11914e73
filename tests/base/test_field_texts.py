"""Strings below fields: whose classes, which texts, and what happens without a source."""

from torquer.base.field_texts import texts_below_fields


class Plain:
    """Fields with and without a text."""

    mass_kg: float = 1.0
    """Mass of
    the body."""

    unnamed: float = 2.0
    limit_a_m2: float = 3.0
    """Greatest dipole."""


class Heir(Plain):
    """One text is replaced, one field has its parent's."""

    mass_kg: float = 5.0
    """Mass with fuel."""

    limit_a_m2: float = 4.0

    class Within:
        """A class in a class."""

        width_m: float = 1.0
        """Width."""


def local_class():
    """A class of a function."""

    class Local:
        area_m2: float = 1.0
        """Area."""

    return Local


def test_texts_are_on_one_line_and_only_below_fields():
    """White space of the source is no part of a text; a field without one has none."""
    expected = {"mass_kg": "Mass of the body.", "limit_a_m2": "Greatest dipole."}
    assert texts_below_fields(Plain) == expected


def test_an_heir_has_its_own_texts_and_those_that_it_does_not_replace():
    """The nearest text counts."""
    expected = {"mass_kg": "Mass with fuel.", "limit_a_m2": "Greatest dipole."}
    assert texts_below_fields(Heir) == expected


def test_classes_are_found_wherever_they_are_written():
    """In a class and in a function."""
    assert texts_below_fields(Heir.Within) == {"width_m": "Width."}
    assert texts_below_fields(local_class()) == {"area_m2": "Area."}


def test_a_class_without_a_source_states_nothing():
    """One that was made in a call."""
    made = type("Made", (), {"__annotations__": {"mass_kg": float}, "__module__": "nowhere"})
    assert texts_below_fields(made) == {}
