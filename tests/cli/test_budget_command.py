"""`torquer budget`: table, JSON, picture, mistakes."""

import pytest

from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def test_table_and_picture(call, scenario, tmp_path):
    code, out, err = call("budget", scenario, "--out", tmp_path / "made")
    assert (code, err) == (0, "")
    assert out.startswith("Torque budget of short, µN m")
    for name in ("gravity gradient", "all disturbances", "coils (control)", "across the field"):
        assert name in out
    assert (tmp_path / "made/torques.png").stat().st_size > 10_000
    assert str(tmp_path / "made/torques.png") in out


def test_json_of_a_held_attitude(call, scenario, strict_json):
    code, out, err = call("budget", scenario, "--hold", "--json")
    data = strict_json(out)
    assert (code, err) == (0, "")
    assert (data["scenario"], data["attitude_held"], data["duration_s"]) == ("short", True, 300.0)
    assert set(data["torques"]) == {"gravity_gradient", "all"}
    row = data["torques"]["all"]
    assert row["rms_size_n_m"] <= row["greatest_size_n_m"]
    assert row["share"] == row["rms_size_n_m"] / data["coils_across_field"]["mean_n_m"]


def test_mistakes_and_failures_are_one_line(call, scenario, tmp_path):
    code, out, err = call("budget", tmp_path / "none.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    (tmp_path / "file").write_text("")
    code, _, err = call("budget", scenario, "--out", tmp_path / "file")
    assert code == 2 and err.startswith("error: --out: must be a folder that can be written")
    fast = scenario.read_text() + "\n[disturbance]\nconstant_torque_n_m = [0.0, 0.0, 1e3]\n"
    scenario.write_text(fast)
    code, out, err = call("budget", scenario)
    assert (code, out) == (1, "") and err.count("\n") == 1


def test_options_of_a_pointing_budget_need_it(call, scenario):
    code, out, err = call("budget", scenario, "--flights", "3")
    assert (code, out) == (2, "") and "--flights: must be given with --pointing alone" in err
    code, out, err = call("budget", scenario, "--pointing", "--hold")
    assert (code, out) == (2, "") and "--hold: must be left out with --pointing" in err


def test_a_pointing_budget_needs_a_law_that_holds_an_attitude(call, scenario):
    code, out, err = call("budget", scenario, "--pointing")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "must have one law that holds an attitude" in err
