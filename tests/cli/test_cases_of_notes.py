"""Files that were wrongly refused, wrongly accepted, or met with silence; as users type them."""

import pytest
from spellings import TLE

from torquer.analysis.notes import notes, run_notes

HEAD = """
start = 2025-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [8, -5, 3]
control = { law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }, sample_s = 1.0 }
simulation = { revolutions = 1, record_s = 5.0 }
"""
RADIUS = 'orbit = { kind = "circular", radius_km = 6878.137, inclination_deg = 51.6 }'
ALTITUDES = (
    'orbit = {{ kind = "kepler", perigee_altitude_km = {}, apogee_altitude_km = {}, '
    "inclination_deg = 51.6 }}"
)
SUN_SYNCHRONOUS = (
    'orbit = { kind = "circular", altitude_km = 600, inclination_deg = 97.79, raan_deg = 10.0 }'
)
LONG = "simulation = { duration_s = 5184000, record_s = 600.0 }"
HOUR = "simulation = { duration_s = 3000, record_s = 10.0 }"
REENTERED = (
    "1 55897U 22151AAV 25058.12407234  .09435527  24934+0  44853-1 0  9999",
    "2 55897  98.5849 110.9278 0014449 269.2407  90.7207 15.92146194 26688",
)
#: An archived set: each line ends before its checksum.
ARCHIVED = (
    "1 00058U 60013A   97142.85906518  .00000093  00000-0 +10762-4 0  274",
    "2 00058 028.3286 356.4726 0164991 158.6392 202.1128 13.4602145880282",
)


def sgp4(lines):
    return f'orbit = {{ kind = "sgp4", tle = {list(lines)} }}'.replace("'", '"')


@pytest.fixture
def file(tmp_path):
    """`file(*lines)`: a scenario in which these lines stand in place of those of the same key."""

    def written(*lines):
        keys = {line.split(" =")[0]: line for line in HEAD.split("\n") if line}
        keys |= {line.split(" =")[0]: line for line in lines}
        path = tmp_path / "case.toml"
        path.write_text("\n".join(keys.values()) + "\n")
        return path

    return written


def notes_in(out):
    return [line for line in out.splitlines() if line.startswith("note: ")]


@pytest.mark.parametrize(
    "lines",
    [(RADIUS,), ("start = 2022-12-12T16:40:00Z", sgp4(TLE), HOUR)],
    ids=["by its radius", "ends before its orbit"],
)
def test_what_can_be_flown_is_valid_without_a_note(call, file, lines):
    code, out, err = call("validate", file(*lines))
    assert (code, err) == (0, "") and not notes_in(out)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ((ALTITUDES.format(100, 300),), "orbit: the perigee's altitude is 100 km: below 120 km"),
        ((ALTITUDES.format(5e5, 5.5e5),), "or is it 500 km in metres?"),
        ((SUN_SYNCHRONOUS, LONG), "turns the plane by 0.99 deg a day, 59 deg in this run"),
        (("initial.quaternion = [1, 0, 0, 0]", 'initial.reference = "orbital"'),
         "is half a turn about x: the scalar is last here"),
    ],
)  # fmt: skip
def test_what_was_silent_has_a_note(call, file, lines, words):
    code, out, err = call("validate", file(*lines))
    assert (code, err) == (0, "")
    assert any(words in note for note in notes_in(out))


@pytest.mark.parametrize(
    ("lines", "error"),
    [
        (("start = 2025-03-20T21:39:00Z", sgp4(REENTERED)),
         "error: sgp4: no orbit at t = 0 s (2025-03-20T21:39:00+00:00): it would be 2.2002e+10 km "
         "from the Earth's centre, and the orbit of the elements has 6664.77 to 6684.06 km: they "
         "do not hold at this time\n"),
        (("spacecraft.gyro.noise_deg_sqrt_h = 0.15",),
         "error: spacecraft.gyro.noise_deg_sqrt_h: must be a known key; received 0.15 (did you "
         "mean noise_deg_s? It is the angle random walk in deg/sqrt(h) / 60 / sqrt(sample_s))\n"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", [("validate",), ("run",), ("field", "orbit", "--scenario")])
def test_what_is_wrong_is_refused_with_its_cause(call, file, tmp_path, command, lines, error):
    out = ("--out", tmp_path / "out") if command == ("run",) else ()
    assert call(*command, file(*lines), *out)[::2] == (2, error)


def test_archived_elements_are_told_what_they_lack(call, tmp_path):
    (tmp_path / "archived.tle").write_text("\n".join(ARCHIVED) + "\n")
    asked = ("field", "orbit", "--tle", tmp_path / "archived.tle", "--duration-min", "1")
    code, _, err = call(*asked)
    lines = err.splitlines()
    assert code == 2 and len(lines) == 2
    for number, digit, line in zip("12", "61", lines, strict=True):
        assert line == (
            f"error: --tle: tle line {number}: must have 69 columns; received 68, without the "
            f"checksum (column 69), which would be {digit}; --scenario with "
            "orbit.without_checksums = true does without"
        )
    completed = "\n".join(line + digit for line, digit in zip(ARCHIVED, "61", strict=True))
    (tmp_path / "archived.tle").write_text(completed + "\n")
    assert call(*asked)[0] == 0


@pytest.mark.parametrize("json", [(), ("--json",)])
def test_a_note_that_fails_does_not_fail_the_check(call, file, monkeypatch, json, strict_json):
    def breaks(scenario):
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(notes, "_CHECKS", {"the tides": breaks})
    for where in ("mode_notes.mode_findings", "fault_notes.unnoticed_faults"):
        monkeypatch.setattr(f"torquer.analysis.notes.{where}", breaks)
    code, out, err = call("validate", file(), *json)
    said = strict_json(out)["notes"] if json else notes_in(out)
    assert (code, err) == (0, "")
    assert [note.removeprefix("note: ").split(" could not")[0] for note in said] == [
        "the tides", "the table of modes", "the faults that go unnoticed",
    ]  # fmt: skip


def test_a_note_that_fails_does_not_fail_the_run(call, file, monkeypatch, no_report, tmp_path):
    def breaks(*about):
        raise IndexError("out of range")

    monkeypatch.setattr(notes, "_CHECKS", {"the tides": breaks})
    monkeypatch.setattr(run_notes, "_CHECKS", {"the steps of the run": breaks})
    short = "simulation = { duration_s = 60, record_s = 5.0 }"
    code, _, err = call("run", file(short), "--out", tmp_path / "out")
    assert code == 0
    assert "note: the tides could not be assessed: unexpected IndexError (out of range)" in err
    assert "note: the steps of the run could not be assessed: unexpected IndexError" in err
