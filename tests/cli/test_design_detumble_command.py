"""`torquer design detumble`: gains flown, the one chosen, files, one line per mistake."""

import pytest

import torquer

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
    assert 0.5 < best["settled_s"]["0.5"] / best["theory_s"] < 2.0
    slowest = found["flights"][0]
    assert slowest["peak_share"] < 1.0 and slowest["energy_j"] < best["energy_j"]
    assert (out / "gains.png").read_bytes().startswith(b"\x89PNG")
    law = torquer.load_scenario(out / "scenario.toml").control.law
    assert law.gain_a_m2_s_per_t == pytest.approx(found["gain_a_m2_s_per_t"], rel=1e-3)


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
