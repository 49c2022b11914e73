"""Requirements: each is verified by a test, and tests name only those that there are."""

from pathlib import Path

from flight_requirements import requirements, verifications

TESTS = Path(__file__).parents[2]


def test_each_requirement_is_verified_by_a_test():
    verified = {number for number, _, _ in verifications(TESTS)}
    assert [each.number for each in requirements() if each.number not in verified] == []


def test_tests_name_requirements_that_there_are():
    known = [each.number for each in requirements()]
    assert len(set(known)) == len(known)
    assert [row for row in verifications(TESTS) if row[0] not in known] == []


def test_every_requirement_is_a_sentence():
    for each in requirements():
        assert each.text.endswith(".") and each.number.startswith("REQ-"), each
