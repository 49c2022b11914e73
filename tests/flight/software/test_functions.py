"""Functions of the source: each names requirements that tests verify, or says why it has none."""

from pathlib import Path

from flight_functions import functions
from flight_requirements import requirements, verifications

TESTS = Path(__file__).parents[2]


def test_functions_name_requirements_that_are_verified():
    known = {each.number for each in requirements()}
    verified = {number for number, _, _ in verifications(TESTS)}
    named = {number for each in functions() for number in each.requirements}
    assert sorted(named - (known & verified)) == []


def test_what_is_not_there_in_full_says_why():
    found = functions()
    assert [each.what for each in found if each.state == "no" and not each.missing] == []
    assert {each.state for each in found} == {"yes", "partial", "no"}
    assert len({each.what for each in found}) == len(found) >= 50
    assert all("App. A" in each.source or each.source[:2] == "3." for each in found)
