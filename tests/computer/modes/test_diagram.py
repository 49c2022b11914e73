"""Diagrams: all that a table says is in them, and nothing lies on anything else."""

import itertools
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from flown_modes import J, Z

from torquer.computer.modes.diagram import mermaid, svg
from torquer.computer.modes.layout import LETTER, layout
from torquer.computer.modes.scheme import as_modes
from torquer.computer.modes.spec import Modes
from torquer.computer.modes.wording import state_in_words, transition_in_words
from torquer.computer.scheme import Scheme

FILE = Path(__file__).parents[2] / "data" / "sun_pointing_modes.toml"
DAMPED = {"nutation_below_deg": 5.0, "for_s": 60.0, "at_most_s": 2e4}
STAGES = [
    {"laws": [{"kind": "bdot", "gain_a_m2_s_per_t": 5e5}], "until": DAMPED},
    {"laws": [{"kind": "off"}], "until": {"at_least_s": 5.0}},
]
#: Everything that can be said of a state and a transition.
FULL = {
    "states": {
        "a-b": {
            "laws": {"bdot": 0.5, "sdot": 1.0}, "estimator": "triad", "coils": "on",
            "wheels": "off", "coils_off": ["x", "z"], "laws_off": ["bdot"],
            "set": {"bdot.gain": 3.0, "sdot.axis": (1.0, 0.0, 0.5)},
            "transitions": [
                {"to": "c", "when": {"signal": "reading_age_s", "sensor": "sun_sensors",
                                     "above": 5.0, "back_below": 2.0}},
                {"to": "a-b", "when": {"signal": "entries", "state": "c", "below": 3.0}},
            ],
        },
        "c": {
            "transitions": [
                {"to": "d", "when": {"signal": "sunlit_fraction", "below": 0.1}, "for_s": 9.0},
                {"to": "d", "when": [
                    {"signal": "sensor_suspected", "sensor": "sun_sensors", "below": 0.5},
                    {"signal": "coil_suspected", "coil": "x", "above": 0.5},
                ], "at_least_s": 60.0, "back_off": 2.0, "most_entries": 3},
            ]
        },
        "d": {"final": True},
    },
    "inertia_kg_m2": J,
    "noise": {"magnetometer_noise_nt": 100, "sun_noise_deg": 0.2, "gyro_noise_deg_s": 0.02,
              "rate_tolerance_deg_s": 0.06},
    "transitions": [
        {"to": name, "when": {"signal": "field_nt", "above": 1e4}, "at_least_s": 2.0}
        for name in ("c", "d", "a-b")
    ],
}  # fmt: skip
TABLES = {
    "parallel": Modes.model_validate(tomllib.loads(FILE.read_text())),
    "chain": as_modes(Scheme(axis=Z, inertia_kg_m2=J, stages=STAGES))[0],
    "full": Modes.model_validate(FULL),
}
tables = pytest.mark.parametrize("modes", TABLES.values(), ids=TABLES)


def overlap(a, b):
    """Whether two rectangles (left, top, right, bottom) have a point in common."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def box_of(box):
    return (box.x, box.y, box.x + box.width, box.y + box.height)


def labels_of(drawn):
    """Rectangles of the labels."""
    return [
        (x, y - 10.0, x + LETTER * len(path.label), y + 3.0)
        for path in drawn.paths
        for x, y in [path.label_at]
    ]


@tables
def test_nothing_lies_on_anything_else(modes):
    drawn = layout(modes)
    parts = [*map(box_of, drawn.boxes), *labels_of(drawn)]
    parts += [(0.0, y - 10.0, drawn.width, y + 3.0) for y, _ in drawn.titles]
    parts += [(0.0, y, drawn.width, y) for y in drawn.rules]
    assert not any(overlap(a, b) for a, b in itertools.combinations(parts, 2))


@tables
def test_everything_is_within_the_picture(modes):
    drawn = layout(modes)
    for left, top, right, bottom in [*map(box_of, drawn.boxes), *labels_of(drawn)]:
        assert 0.0 < left < right < drawn.width and 0.0 < top < bottom < drawn.height
    for x, y in (corner for path in drawn.paths for corner in path.corners):
        assert 0.0 < x < drawn.width and 0.0 < y < drawn.height
    for box in drawn.boxes:
        assert max(map(len, box.lines)) * LETTER < box.width


@tables
def test_ways_run_from_box_to_box_and_share_no_lane(modes):
    drawn = layout(modes)
    boxes = [box_of(box) for box in drawn.boxes]
    for path in drawn.paths:
        for x, y in (path.corners[0], path.corners[-1]):
            assert sum(box[2] == x and box[1] < y < box[3] for box in boxes) == 1
    lanes = [(*path.corners[1], path.corners[2][1]) for path in drawn.paths]
    for (x, *one), (other_x, *other) in itertools.combinations(lanes, 2):
        apart = max(one) < min(other) or max(other) < min(one)
        assert x != other_x or apart


@tables
def test_the_picture_says_all_that_the_table_says(modes):
    root = ElementTree.fromstring(svg(modes))
    answer = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text")]
    expected = []
    for name, region in modes.regions.items():
        expected += [name] if len(modes.regions) > 1 else []
        expected += ["any state"] if region.transitions else []
        expected += [transition_in_words(way) for _, way in region.all_transitions()]
        for state, spec in region.states.items():
            expected += [state, *state_in_words(spec)]
    assert sorted(answer) == sorted(expected)
    final = sum(state.final for r in modes.regions.values() for state in r.states.values())
    rectangles = [r.get("class") for r in root.iter("{http://www.w3.org/2000/svg}rect")]
    assert rectangles.count("inner") == final


def test_words_of_states_and_transitions():
    state = TABLES["full"].regions["main"].states["a-b"]
    assert state_in_words(state) == [
        "0.5 x bdot", "sdot", "estimator triad", "coils on", "wheels off", "x coil off",
        "z coil off", "bdot off", "bdot.gain = 3",
        "sdot.axis = 1, 0, 0.5",
    ]  # fmt: skip
    ways = [
        way for m in TABLES.values() for r in m.regions.values() for _, way in r.all_transitions()
    ]
    words = {transition_in_words(way) for way in ways}
    assert {
        "age of sun sensors reading above 5 s, until below 2", "entries of c below 3",
        "sunlit fraction below 0.1, for 9 s", "field above 10000 nT, after at least 2 s",
        "after 600 s",
        "nutation below 5 deg and rate above 0 deg/s, for 60 s, or after 20000 s",
        "axis to Sun above 160 deg, for 3600 s", "Sun not in view, for 10 s",
        "not in state wrong_way", "after at least 5 s",
        "sun sensors not suspected and x coil suspected, after at least 60 s, "
        "longer by a factor of 2 with each entry, up to entry 3",
    } <= words  # fmt: skip


def test_mermaid_has_regions_side_by_side():
    lines = [line.strip() for line in mermaid(TABLES["parallel"]).splitlines()]
    assert lines[:2] == ["stateDiagram-v2", "state modes {"] and lines[-1] == "}"
    assert lines.count("--") == 2 and sum(line.startswith("[*]") for line in lines) == 3
    assert "damping_off --> damping_on : rate above 0.7 deg/s" in lines
    assert "pointing_reversed : -1 x sdot" in lines


@tables
def test_mermaid_names_states_before_it_uses_them(modes):
    lines = [line.strip() for line in mermaid(modes).splitlines()]
    known = {line.split(" as ")[1] for line in lines if " as " in line} | {"[*]"}
    arrows = [line.split(" : ")[0].split(" --> ") for line in lines if " --> " in line]
    assert {end for arrow in arrows for end in arrow} == known
    assert all(name.isidentifier() for name in known - {"[*]"})
    count = sum(len([*region.all_transitions()]) for region in modes.regions.values())
    assert len([a for a in arrows if "[*]" not in a]) == count


def test_states_differing_only_in_signs_have_distinct_identifiers():
    ways = [{"to": "a_b", "at_most_s": 1.0}]
    text = mermaid(
        Modes(states={"a-b": {"transitions": ways}, "a_b": {}, "any_state": {}}, transitions=ways)
    )
    ids = [line.split(" as ")[1] for line in text.splitlines() if " as " in line]
    assert len(set(ids)) == 4


@tables
def test_start_dot_lies_next_to_its_own_box(modes):
    root = ElementTree.fromstring(svg(modes))
    dots = [each for each in root.iter() if each.tag.endswith("circle")]
    starts = [box_of(box) for box in layout(modes).boxes if box.initial]
    assert len(dots) == len(starts)
    for dot, (left, top, _, bottom) in zip(dots, starts, strict=True):
        assert float(dot.get("cx")) < left and top < float(dot.get("cy")) < bottom
