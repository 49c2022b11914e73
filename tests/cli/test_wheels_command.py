"""`torquer wheels`: tables, JSON, pictures, and one line per mistake."""

from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples/wheels/foton.toml"


def test_tables(call):
    code, out, err = call("wheels", EXAMPLE)
    assert (code, err) == (0, "")
    assert "14 vertices, 24 edges, 12 faces" in out
    assert "Rate, deg/s" in out and "0.1849" in out
    assert "80.5, 45.5" in out and "0 + 1" in out and "pseudo-inv." in out
    assert max(map(len, out.splitlines())) <= 110


def test_json(call, strict_json):
    code, out, err = call("wheels", EXAMPLE, "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    assert answer["momentum"]["worst_rate_deg_s"] == pytest.approx(0.1849, abs=1e-4)
    assert answer["demand"]["rate"]["met"] is True
    assert set(answer["allocation"]) == {"minimax_us", "least_squares_us"}


def test_pictures_and_page(call, tmp_path):
    out_dir = tmp_path / "new/wheels"
    code, out, err = call("wheels", EXAMPLE, "--out", out_dir)
    assert (code, err) == (0, "")
    names = ["accumulation.png", "envelope.png", "failures.png", "wheels.html"]
    assert sorted(path.name for path in out_dir.iterdir()) == names
    assert "envelope.png" in out.splitlines()[-1]


def test_mistakes_are_one_line(call, tmp_path):
    code, out, err = call("wheels", tmp_path / "none.toml")
    assert (code, out) == (2, "")
    assert (
        err.startswith("error: design: must be a readable file; received") and err.count("\n") == 1
    )
    bad = tmp_path / "bad.toml"
    bad.write_text(EXAMPLE.read_text().replace("alpha_deg = 80.5", "alpha_deg = 0"))
    code, out, err = call("wheels", bad)
    assert (code, out) == (2, "")
    assert err == "error: wheels.layout.alpha_deg: must be greater than 0; received 0\n"
    (tmp_path / "file").write_text("")
    code, out, err = call("wheels", EXAMPLE, "--out", tmp_path / "file")
    assert code == 2 and "--out: must be a folder that can be written" in err
