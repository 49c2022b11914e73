"""An answer's rows as text, data and HTML."""

import math

from torquer.base.rows import Row, as_data, as_html, as_text, degrees_text

LINES = [
    [
        Row("", "x", text="a<b"),
        Row("time_s/last", "last", 7200.0, "h", "2"),
        Row("n", value=8),
    ],
    [Row("", "x", text="c"), Row("n", value=9)],
]


def test_programs_read_values_by_key():
    assert [as_data(line) for line in LINES] == [
        {"time_s": {"last": 7200.0}, "n": 8}, {"n": 9},
    ]  # fmt: skip


def test_people_read_texts_below_labels_and_units():
    assert as_text(LINES, 6) == ["     x  last", "           h", "   a<b     2", "     c     -"]
    assert as_text([[LINES[1][0], Row("", "n", text="7")]], 3, 5) == ["x      n", "c      7"]


def test_notebooks_escape_what_they_show():
    html = as_html(LINES, ["x > 0"])
    assert "<th>last [h]</th>" in html and "<td>a&lt;b</td>" in html and "<li>x &gt; 0</li>" in html


def test_rounding_is_no_angle_but_what_is_no_number_is_told():
    assert [degrees_text(x) for x in (3.2e-15, 1.5, math.nan)] == ["0", "1.5", "nan"]
