"""`torquer design mission`: verdicts of all parts, a page with its files, one line per mistake."""

import json

import pytest

import torquer
from torquer.design import MissionRequest, mission
from torquer.design.mission_parts import DOUBTFUL, FAILS, HOLDS, LEFT_OUT, PARTS, STATES

WHEELS = """
[spacecraft.wheels]
layout = { kind = "orthogonal_and_skew" }
momentum_limit_n_m_s = 0.1
torque_limit_n_m = 0.01
speed_limit_rpm = 6000
"""


@pytest.fixture
def coarse(scenario):
    """The satellite with a control step that is quick to design for."""
    text = scenario.read_text().replace("sample_s = 2.0", "sample_s = 20.0")
    text = text.replace("[1.0, -2.0, 3.0]", "[0.5, -0.5, 0.5]").replace("1e6", "2e5")
    scenario.write_text(text.replace("duration_s = 300", "duration_s = 6000"))
    return scenario


@pytest.mark.slow
def test_a_page_has_the_verdicts_and_names_the_files(call, strict_json, coarse, tmp_path):
    out = tmp_path / "out"
    code, text, _ = call("design", "mission", coarse, "--runs", 4, "--json", "--out", out)
    found = strict_json(text)
    assert [*found["parts"]] == [*PARTS]
    states = {name: part["state"] for name, part in found["parts"].items()}
    assert states["pitch wheel"] == states["reaction wheels"] == LEFT_OUT
    assert states["sensors and filter"] == LEFT_OUT
    assert found["verdict"] == max(
        (state for state in states.values() if state != LEFT_OUT), key=STATES.index
    )
    assert code == (1 if found["verdict"] == FAILS else 0)
    assert {state for state in states.values()} <= {HOLDS, DOUBTFUL, FAILS, LEFT_OUT}
    assert states["detumbling"] != LEFT_OUT and states["faults"] != LEFT_OUT
    unsaid = [name for name, part in found["parts"].items() if part["state"] == DOUBTFUL]
    assert [name for name in unsaid if not found["parts"][name]["open"]] == []
    files = {path.name for path in out.iterdir()}
    assert files == {path.rsplit("/", 1)[-1] for path in found["files"]}
    assert {"mission.html", "mission.json", "gains.png", "detumbling.toml"} <= files
    page = (out / "mission.html").read_text(encoding="utf-8")
    assert "Open points" in page and "hold by coils" in page and "gains.png" in page
    assert json.loads((out / "mission.json").read_text())["parts"].keys() == PARTS.keys()
    gain = torquer.load_scenario(out / "detumbling.toml").control.law.gain_a_m2_s_per_t
    chosen = found["parts"]["detumbling"]["answer"]["gain_a_m2_s_per_t"]
    assert gain == pytest.approx(chosen, rel=1e-3)


def test_a_satellite_with_wheels_alone_is_told_what_it_lacks(scenario):
    text = scenario.read_text()
    start, end = text.index("[spacecraft.coils]"), text.index("[spacecraft.magnetometer]")
    law = 'law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }'
    text = text[:start] + WHEELS + text[end:].replace(law, 'law = { kind = "off" }')
    scenario.write_text(text)
    found = mission(torquer.load_scenario(scenario), MissionRequest())
    by_name = {part.name: part for part in found.parts}
    assert by_name["detumbling"].words == by_name["hold by coils"].words == "no coils"
    assert by_name["faults"].words == "no law"
    wheels = by_name["reaction wheels"]
    assert wheels.state == HOLDS and "with one wheel failed" in wheels.words
    assert found.state == HOLDS and not found.fails
    assert "reaction wheels: no rate or momentum is demanded" in "\n".join(found.open_points())
    assert found.lines()[0] == "short: holds" and found._repr_html_().startswith("<table>")


@pytest.mark.parametrize(
    "options, key",
    [(("--pointing-deg", -1), "--pointing-deg"), (("--runs", 0), "--runs")],
)
def test_mistakes_are_told_in_one_line(call, scenario, options, key):
    code, out, err = call("design", "mission", scenario, *options)
    assert (code, out) == (2, "") and err.startswith(f"error: {key}: must ")
    assert err.count("\n") == 1


def test_a_file_that_is_no_scenario_writes_no_folder(call, tmp_path):
    (tmp_path / "bad.toml").write_text("[orbit]\n")
    code, _, err = call("design", "mission", tmp_path / "bad.toml", "--out", tmp_path / "out")
    assert code == 2 and err.startswith("error: ") and not (tmp_path / "out").exists()
