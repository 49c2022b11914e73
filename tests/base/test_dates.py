"""Times as text: exact to the millisecond, and never an error."""

import pytest

from torquer.base.dates import iso_ms, iso_s, table_utc


@pytest.mark.parametrize(
    ("time_ms", "iso", "seconds", "in_table"),
    [
        (-(2**53), f"{-(2**53)} ms since 1970", None, None),
        (-62135596800001, "-62135596800001 ms since 1970", None, None),
        (-1, "1969-12-31T23:59:59.999Z", "1969-12-31T23:59:59Z", "1969-12-31 23:59:59"),
        (0, "1970-01-01T00:00:00.000Z", "1970-01-01T00:00:00Z", "1970-01-01 00:00:00"),
        (1330857107001, "2012-03-04T10:31:47.001Z", "2012-03-04T10:31:47Z", "2012-03-04 10:31:47"),
        (1330857107999, "2012-03-04T10:31:47.999Z", "2012-03-04T10:31:47Z", "2012-03-04 10:31:47"),
        (2**53, f"{2**53} ms since 1970", None, None),
        (2**63, f"{2**63} ms since 1970", None, None),
    ],
)
def test_times_are_exact_and_those_that_are_no_dates_their_number(time_ms, iso, seconds, in_table):
    assert iso_ms(time_ms) == iso
    assert iso_s(time_ms) == (seconds or iso)
    assert table_utc(time_ms) == (in_table or iso)


def test_no_time_is_no_text():
    assert iso_ms(None) == ""
