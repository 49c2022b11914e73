"""`torquer design detumble`: gains flown, the one chosen, files, one line per mistake."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

import torquer
from torquer.design import DetumbleRequest
from torquer.design.detumbling import gains_flown, without_flights
from torquer.design.gain_flights import GainFlights
from torquer.scenario.load import scenario_from_data

CUBESAT = """
start = 2025-01-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 550
inclination_deg = 60
[environment]
field = { kind = "averaged" }
[spacecraft.body]
inertia_kg_m2 = [0.015, 0.014, 0.012]
[spacecraft.coils]
limit_a_m2 = 0.2
[initial]
rate_deg_s = [5.0, 5.0, 5.0]
[control]
sample_s = 2.0
law = { kind = "bdot", gain_a_m2_s_per_t = 2e3 }
[simulation]
revolutions = 5
"""


@pytest.fixture
def detumbling(tmp_path):
    path = tmp_path / "cubesat.toml"
    path.write_text(CUBESAT)
    return path


DETUMBLE = ("--gains", 3, "--runs", 2, "--times", 2)


def test_the_gain_of_bdot_is_flown(call, strict_json, detumbling, tmp_path):
    """The times lie around those of theory; a scenario with the gain chosen can be loaded."""
    out = tmp_path / "out"
    code, text, err = call("design", "detumble", detumbling, *DETUMBLE, "--json", "--out", out)
    assert (code, err) == (0, "")
    found = strict_json(text)
    gains = [each["gain_a_m2_s_per_t"] for each in found["flights"]]
    assert gains == sorted(gains) and 2e3 in gains and found["gain_a_m2_s_per_t"] in gains
    best = next(
        each for each in found["flights"]
        if each["gain_a_m2_s_per_t"] == found["gain_a_m2_s_per_t"]
    )  # fmt: skip
    assert best["stopped"] == best["runs"] == 4
    assert found["rate_below_is"] == "3 orbital rates" and found["residual_deg_s"] is None
    assert 0.0 < best["first_s"]["0.5"] <= best["settled_s"]["0.5"]
    assert 0.5 < best["settled_s"]["0.5"] / best["theory_s"] < 2.0
    slowest = found["flights"][0]
    assert slowest["peak_share"] < 1.0 and slowest["energy_j"] < best["energy_j"]
    assert (out / "gains.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "page.pdf").read_bytes().startswith(b"%PDF")
    law = torquer.load_scenario(out / "scenario.toml").control.law
    assert law.gain_a_m2_s_per_t == pytest.approx(found["gain_a_m2_s_per_t"], rel=1e-3)


@pytest.mark.parametrize(("own", "count"), [(1.003, 3), (1.05, 4)])
def test_gains_that_show_the_same_number_are_flown_once(make, own, count):
    """The file's own in place of that of theory, where a table cannot tell them apart."""
    bare = scenario_from_data(tomllib.loads(CUBESAT) | {"name": "cubesat"})
    theory = without_flights(bare, DetumbleRequest()).theory_gain
    scenario = bare.replace("control.law", {"kind": "bdot", "gain_a_m2_s_per_t": own * theory})
    gains = gains_flown(without_flights(scenario, DetumbleRequest()), 3)
    assert len(gains) == len({f"{each:.3g}" for each in gains}) == count
    assert own * theory in gains


@pytest.mark.parametrize(
    ("hours", "words"),
    [
        ((5.0, 5.1, 5.2, 5.3), "the least flown"),
        ((5.0, 2.0, 2.1, 2.2), ""),
        ((5.0, 4.0, 3.0, 4.0), "the greatest flown that does not overshoot"),
        ((5.0, 4.0, 3.0), "the greatest flown"),
    ],
)
def test_a_gain_at_an_end_of_those_flown_is_said_to_be(detumbling, hours, words):
    """Beyond the ends nothing is known; the fourth is the law's, beyond half of what overshoots."""
    case = without_flights(torquer.load_scenario(detumbling), DetumbleRequest())
    gains = [1e3, 2e3, 4e3, 0.6 * case.most_gain]
    flights = tuple(
        GainFlights(gain, *(np.full(4, x) for x in (each, 3600.0 * each, 1.0, 0.1, 0.1, 0.1)))
        for gain, each in zip(gains, hours, strict=False)
    )
    sweep = replace(case, flights=flights)
    assert sweep.data()["gain_is"] == sweep.chosen_is == words
    assert sweep.words()[0].endswith(f", {words}" if words else f"= {sweep.chosen.gain:.4g}")


RESIDUAL = """
start = 2026-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 97.4 }
initial.rate_deg_s = [15, 15, 15]
simulation.revolutions = 4
[spacecraft]
body.inertia_kg_m2 = [0.0429, 0.0429, 0.0068]
magnetometer.noise_nt = 100
coils = { limit_a_m2 = 0.24, residual_dipole_a_m2 = [0.005, 0.005, 0.005], power_at_limit_w = 0.5 }
[control]
sample_s = 0.5
law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }
"""


def test_a_time_by_theory_that_flights_refute_is_doubtful(call, strict_json, detumbling):
    """Near the equator rotation about the field is hardly braked."""
    code, text, _ = call("design", "detumble", detumbling, *DETUMBLE, "--json")
    inclined = strict_json(text)["verdict"]
    assert (code, inclined) == (0, {"state": "valid", "doubts": []})
    detumbling.write_text(CUBESAT.replace("inclination_deg = 60", "inclination_deg = 1"))
    code, text, _ = call("design", "detumble", detumbling, *DETUMBLE, "--json")
    found = strict_json(text)["verdict"]
    assert (code, found["state"]) == (0, "doubtful")
    named = [doubt["quantity"] for doubt in found["doubts"]]
    assert any(each.startswith("braking about the field's mean direction") for each in named)
    code, text, _ = call("design", "detumble", detumbling, *DETUMBLE)
    assert f"doubtful: {found['doubts'][0]['text']}" in text


def few(call, path, *options):
    few = ("--gains", 3, "--runs", 16, "--times", 1)
    code, out, err = call("design", "detumble", path, *few, *options)
    assert (code, err) == (0, "")
    return out


def test_a_limit_within_the_residual_motion_chooses_no_gain(call, strict_json, tmp_path):
    """A residual dipole keeps the rate around 0.19 deg/s: to stay below it is chance."""
    path = tmp_path / "residual.toml"
    path.write_text(RESIDUAL)
    found = strict_json(few(call, path, "--json"))
    assert found["rate_below_is"] == "above the residual motion"
    floor = found["residual_deg_s"]
    assert 0.07 < floor["mean"] < 0.19 < floor["greatest"] < 0.35
    assert 1.5 * floor["greatest"] <= found["rate_below_deg_s"] < 2.0 * floor["greatest"]
    best = next(
        each for each in found["flights"]
        if each["gain_a_m2_s_per_t"] == found["gain_a_m2_s_per_t"]
    )  # fmt: skip
    assert best["settled_s"]["0.5"] < 3 * 3600.0  # of 15.8 h flown
    note = found["notes"][0]
    assert note.startswith("3 orbital rates, 0.19 deg/s, lie within the residual motion, 0.")
    assert f"{found['rate_below_deg_s']:.3g} deg/s counts as stopped" in note

    given = strict_json(few(call, path, "--json", "--rate-below-deg-s", 0.19))
    assert (given["rate_below_is"], given["rate_below_deg_s"]) == ("given", 0.19)
    assert given["notes"][0].startswith(
        "the limit of 0.19 deg/s lies within the residual motion, 0."
    )
    texts = [doubt["text"] for doubt in given["verdict"]["doubts"]]
    assert any("over the greatest that remains" in text for text in texts)
    last = given["flights"][-1]  # it was below soon, and stays below from the end of its flight on
    assert last["first_s"]["0.5"] < 2 * 3600.0
    assert last["settled_s"]["0.5"] is None or last["settled_s"]["0.5"] > 10 * 3600.0

    text = few(call, path, "--rate-below-deg-s", 1)
    assert "residual motion" not in text and "half of them are first below it after" in text
    assert "first half" in text.splitlines()[0]


def test_no_gain_stops_a_tumbling_satellite_at_once(call, detumbling):
    code, out, err = call("design", "detumble", detumbling, *DETUMBLE, "--within-s", 100)
    assert (code, err) == (0, "") and "no gain stops all of them in time: coils always" in out
    assert "0 of 4 releases at 8.66 deg/s" in out


@pytest.mark.parametrize(
    ("options", "message"),
    [(("--tip-off-deg-s", 60), "--tip-off-deg-s: must be below 45 deg/s, the greatest rate that"),
     (("--tip-off-deg-s", 0.01), "--tip-off-deg-s: must be above 0.188 deg/s, the rate that"),
     (("--gains", 2), "--gains: must lie within 3..99; received 2"),
     (("--runs", 1.5), "must be a whole number; received 1.5"),
     (("--within-s", -1), "--within-s: must be a positive number; received -1")],
)  # fmt: skip
def test_mistakes_about_gains_of_bdot(call, detumbling, options, message):
    code, _, err = call("design", "detumble", detumbling, *options)
    assert code == 2 and message in err and len(err.splitlines()) == 1


SCHEME = """{ kind = "scheme", stages = [
  { laws = [{ kind = "bdot", gain_a_m2_s_per_t = 1e4 }], until = { rate_below_deg_s = 1 } },
  { laws = [{ kind = "off" }] },
] }"""


@pytest.mark.parametrize(
    ("law", "message"),
    [('{ kind = "sdot", gain_a_m2_s = 1.0 }', "control.law.kind: must be bdot or one like it"),
     (SCHEME, "control: must have one law, without modes or stages; received more")],
)  # fmt: skip
def test_gains_are_those_of_one_law(call, detumbling, law, message):
    lines = detumbling.read_text().splitlines()
    detumbling.write_text(
        "\n".join(f"law = {law}" if each.startswith("law =") else each for each in lines)
    )
    code, _, err = call("design", "detumble", detumbling)
    assert code == 2 and message in err
