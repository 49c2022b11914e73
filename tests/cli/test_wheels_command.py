"""`torquer wheels`: tables, JSON, pictures, and one line per mistake."""

import json
from pathlib import Path

import pytest

from torquer.base.limits import RequestError
from torquer.design.requests import WheelsRequest
from torquer.design.wheel_file import load_wheels
from torquer.design.wheel_report import wheels

EXAMPLE = Path(__file__).parents[2] / "examples/wheels/foton.toml"


def test_tables(call):
    code, out, err = call("wheels", EXAMPLE)
    assert (code, err) == (0, "")
    assert "14 vertices, 24 edges, 12 faces" in out
    assert "Rate, deg/s" in out and "0.1849" in out
    assert "alpha 80.5, beta 45.5" in out and "0 + 1" in out and "pseudo-inv." in out
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


def test_a_sweep_is_a_table_and_a_picture(call, tmp_path, strict_json):
    code, out, err = call("wheels", EXAMPLE, "--sweep", "alpha_deg=60:88:15", "--out", tmp_path)
    assert (code, err) == (0, "") and (tmp_path / "sweep.png").stat().st_size > 10_000
    assert "highest guaranteed rate of the sweep: 0.1849 deg/s at alpha_deg = 80.51" in out
    assert max(map(len, out.splitlines()[:-2])) <= 110
    code, out, err = call("wheels", EXAMPLE, "--sweep", "alpha_deg=60:88:15", "--json")
    points = strict_json(out)["sweep"]["points"]
    assert len(points) == 16 and points[0]["alpha_deg"] == 60.0


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("gamma_deg=20:80", "must be ANGLE=FROM:TO, such as alpha_deg=20:85 or"),
        ("alpha_deg", "must be ANGLE=FROM:TO"),
        ("alpha_deg=a:80", "must have numbers"),
        ("alpha_deg=80:20", "must increase, from above 0 to below 90 deg; received 'alpha_deg=80"),
        ("alpha_deg=20:90", "must increase, from above 0 to below 90 deg"),
        ("alpha_deg=20:80:1", "must have 2 to 1001 points; received 1"),
    ],
)
def test_a_mistaken_sweep_is_one_line(call, asked, expected):
    code, out, err = call("wheels", EXAMPLE, "--sweep", asked)
    assert (code, out) == (2, "") and err.startswith(f"error: --sweep: {expected}")
    assert err.count("\n") == 1


def test_axes_cannot_be_swept(call, tmp_path):
    file, text = tmp_path / "axes.toml", EXAMPLE.read_text()
    layout = 'layout = { kind = "four_sided_pyramid", alpha_deg = 80.5, beta_deg = 45.5 }'
    file.write_text(text.replace(layout, 'layout = { kind = "orthogonal" }'))
    code, _, err = call("wheels", file, "--sweep", "alpha_deg=20:80")
    assert code == 2 and "must name an angle of the layout; orthogonal has none" in err


def test_an_acceleration_needs_torques(call, tmp_path):
    file = tmp_path / "no_torque.toml"
    file.write_text(EXAMPLE.read_text().replace("torque_limit_n_m = 0.2", ""))
    code, _, err = call("wheels", file)
    assert code == 2
    assert "wheels.torque_limit_n_m: must be given with demand.acceleration_deg_s2" in err


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


def test_python_gets_the_same_report(call, strict_json):
    report = wheels(load_wheels(EXAMPLE), WheelsRequest(sweep="alpha_deg=60:88:15"))
    answer = strict_json(call("wheels", EXAMPLE, "--sweep", "alpha_deg=60:88:15", "--json")[1])
    plain = report.data()
    assert plain.pop("allocation").keys() == answer.pop("allocation").keys()  # seconds
    assert json.loads(json.dumps(plain)) == answer
    table = report._repr_html_()
    assert table.count("<table>") == 4 and "<td>alpha 80.5, beta 45.5</td>" in table
    with pytest.raises(RequestError, match=r"^sweep: must be ANGLE=FROM:TO, such as alpha_deg="):
        wheels(load_wheels(EXAMPLE), WheelsRequest(sweep="gamma_deg=20:80"))
