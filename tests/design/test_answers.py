"""`torquer.design` from Python: the numbers of the command, the table, the picture."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import torquer
from torquer.base.limits import RequestError
from torquer.base.strict_json import json_text
from torquer.cli import main
from torquer.design import (
    BenchRequest,
    CoilRequest,
    DetumbleRequest,
    MagnetoGyroRequest,
    ThreeAxisRequest,
    bench,
    coil,
    detumble,
    magneto_gyro,
    three_axis,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
COIL = CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4)
BENCH = BenchRequest(time_s=600.0, bench_inertia=0.4, inertia=1.6, bench_field_nt=1e5, field_nt=1e4)
CUBESAT = ThreeAxisRequest(
    inertia=(0.015, 0.014, 0.007), altitude_km=470.0, inclination_deg=52.0, limit_a_m2=0.2,
    sample_s=10.0, field="averaged",
)  # fmt: skip
DETUMBLE = DetumbleRequest(tip_off_deg_s=5.0, gains=3, runs=2, times=2)
GYRO = MagnetoGyroRequest(evaluations=10, fly=0)


def _options(request) -> list[str]:
    """The request as options of the command."""
    words = []
    for key, default in ((x.name, x.default) for x in type(request).__dataclass_fields__.values()):
        if (value := getattr(request, key)) != default:
            values = value if isinstance(value, tuple) else (value,)
            words += [f"--{key.replace('_', '-')}", *map(str, values)]
    return words


@pytest.fixture
def printed(capsys):
    """`printed("coil", request)`: what the command prints as JSON."""

    def run(command, request, *files):
        with pytest.raises(SystemExit) as left:
            main(["design", command, *map(str, files), *_options(request), "--json"])
        assert left.value.code == 0
        return json.loads(capsys.readouterr().out)

    return run


def _plain(answer) -> dict:
    """Data of an answer as JSON gives it back."""
    return json.loads(json_text(answer.data()))


def _is_table_of(answer, *texts: str) -> bool:
    html = answer._repr_html_()
    return html.startswith("<table>") and all(text in html for text in texts)


def test_bench(printed):
    answer = bench(BENCH)
    assert _plain(answer) == printed("bench", BENCH)
    assert answer.time_s.saturated == pytest.approx(24_000.0)
    assert _is_table_of(answer, "at their limits", "in orbit [min]", "400")
    with pytest.raises(TypeError, match="plot: must be given one of CoilSizes, GainSweep"):
        torquer.plot(answer)


def test_coil(printed):
    answer = coil(COIL)
    assert _plain(answer) == printed("coil", COIL)
    assert _is_table_of(answer, "wire [mm]", "copper 0.6976 W")
    assert len(torquer.plot(answer).axes[0].lines[0].get_xdata()) == len(answer.coils)
    with pytest.raises(RequestError, match=r"^mass_kg: must leave a winding no thicker"):
        coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=4000.0))


def test_three_axis(printed):
    answer = three_axis(None, CUBESAT)
    found = printed("three-axis", CUBESAT)
    assert found.pop("files") == [] and _plain(answer) == found
    assert _is_table_of(answer, "degree [1/rad]", "regulator", "error [deg]")
    axes = torquer.plot(answer).axes[0]
    assert axes.get_xlabel() == "k, of the rate [N m s/T²]"
    said = [text.get_text() for text in axes.get_legend().get_texts()]
    for name in ("formula", "refined"):
        doubts = answer.verdict_on(name).doubts
        assert (name + ": doubtful" * bool(doubts)) in said


def test_a_picture_of_gains_says_which_are_doubtful():
    """Laws with an error of no use, as text and JSON say."""
    answer = replace(three_axis(None, CUBESAT), within_deg=-1.0)  # any error is too great
    said = [text.get_text() for text in torquer.plot(answer).axes[0].get_legend().get_texts()]
    assert {"formula: doubtful", "refined: doubtful"} <= set(said)


def test_three_axis_wants_one_description_of_the_satellite():
    with pytest.raises(RequestError, match=r"^inertia: must be given, or a scenario; received no"):
        three_axis()
    scenario = torquer.load_scenario(EXAMPLES / "chibis_m_detumble.toml")
    with pytest.raises(RequestError, match=r"^altitude_km: must not be given with a scenario; rec"):
        three_axis(scenario, ThreeAxisRequest(altitude_km=500.0))
    with pytest.raises(RequestError, match=r"^limit_a_m2: must be greater than 0; received -1"):
        three_axis(None, ThreeAxisRequest(**{**vars(CUBESAT), "limit_a_m2": -1.0}))


def test_detumble(printed):
    path, calls = EXAMPLES / "chibis_m_detumble.toml", []
    answer = detumble(torquer.load_scenario(path), DETUMBLE, lambda *done: calls.append(done))
    found = printed("detumble", DETUMBLE, path)
    assert found.pop("files") == [] and _plain(answer) == found
    total = len(answer.flights) * 4
    assert calls[-1] == (total, total) and len(calls) == total // 2
    gain = answer.with_gain().control.law.gain_a_m2_s_per_t
    assert gain == pytest.approx(answer.chosen.gain, rel=1e-3)
    assert _is_table_of(answer, "gain [A m^2 s/T]", f"{answer.chosen.gain:.3g}")
    figure = torquer.plot(answer)
    assert figure.axes[2].get_xlabel().startswith("gain [A m² s/T]")
    assert figure.get_suptitle().endswith(": doubtful") == bool(answer.verdict.doubts)


def test_detumble_refuses_a_rate_by_its_key():
    scenario = torquer.load_scenario(EXAMPLES / "chibis_m_detumble.toml")
    with pytest.raises(RequestError, match=r"^tip_off_deg_s: must be above .* deg/s, the rate"):
        detumble(scenario, DetumbleRequest(tip_off_deg_s=0.01))


def test_magneto_gyro(printed):
    path = EXAMPLES / "magneto_gyro.toml"
    answer = magneto_gyro(torquer.load_scenario(path), GYRO)
    found = printed("magneto-gyro", GYRO, path)
    assert found.pop("files") == [] and _plain(answer) == found
    assert _is_table_of(answer, "lambda", "stage 2, degree", "field model")
    assert [*torquer.plot(answer)] == ["wheel", "errors", "orbits"]
    with pytest.raises(RequestError, match=r"^filter_rate_rad_s: .* \(tip_off_deg_s\); received"):
        magneto_gyro(answer.case.scenario, MagnetoGyroRequest(filter_rate_rad_s=0.05))


def test_importing_the_room_loads_no_compiler():
    code = (
        "import sys; from torquer.design import DetumbleRequest, CoilRequest, coil; "
        "coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4)); "
        "print([m for m in ('numba', 'numpy', 'scipy', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
