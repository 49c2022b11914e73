"""`torquer theory`: numbers, printed equations, scenarios, design tables, one line per mistake."""

import json
import math
import re
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.base.limits import RequestError
from torquer.base.strict_json import json_text
from torquer.environment.field.averaged import cone_angle
from torquer.report.plot import plot
from torquer.scenario.load import load_scenario
from torquer.theory.averaged import equations as text
from torquer.theory.averaged.answer import law_gains, law_motion
from torquer.theory.averaged.case import case_from_scenario
from torquer.theory.averaged.requests import LawRequest
from torquer.theory.slow.evolution import EVOLUTIONS
from torquer.theory.slow.evolution.model import Case, Slow
from torquer.theory.slow.gain_and_time import slow_time
from torquer.theory.slow.gains import bdot_greatest_gain, damping_efficiency, sampling_limit_rad_s
from torquer.theory.slow.second_moments import averaged_moments

SATELLITE = ("--inclination-deg", "60", "--altitude-km", "500", "--inertia", "1.5", "1.5", "1.2")
BDOT = ("bdot", *SATELLITE, "--gain", "4e4", "--rate-deg-s", "5", "5", "5")
SCENARIO = """
start = 2012-03-04T10:31:47Z
[orbit]
kind = "circular"
altitude_km = 500
inclination_deg = 60
raan_deg = 40
[environment]
field = {{ kind = "averaged" }}
earth_rotation = "sidereal"
[spacecraft.body]
inertia_kg_m2 = [1.5, 1.5, 1.2]
[spacecraft.coils]
limit_a_m2 = 300.0
[initial]
rate_deg_s = [{rate}]
[control]
sample_s = 1.0
{windows}
law = {{ {law} }}
[simulation]
duration_s = 300
"""


@pytest.fixture
def theory(call):
    """`theory("bdot", ...)`: exit code, output, errors."""
    return lambda *arguments: call("theory", *arguments)


@pytest.fixture
def scenario(tmp_path):
    """`scenario(law)`: path of a file with this law."""

    def write(law, rate="5, 5, 5", windows=""):
        path = tmp_path / "mine.toml"
        path.write_text(SCENARIO.format(law=law, rate=rate, windows=windows))
        return path

    return write


# ------------------------------------------------------------ what is printed is what is computed


def in_python(formula: str) -> str:
    """A printed formula as Python: functions get brackets, products their stars."""
    shown = formula.replace("|cos rho|", "abs(cos rho)")
    shown = re.sub(r"\b(sin|cos|tan)\^2 (\w+)", r"\1(\2)**2", shown)
    shown = re.sub(r"\b(sin|cos|tan) (\w+)", r"\1(\2)", shown)
    shown = re.sub(r"\bln ((?:sin|cos|tan)\(\w+\)|l\b)", r"log(\1)", shown)
    shown = shown.replace("ln(", "log(").replace("ln|d|", "log(abs(d))").replace("|d|", "abs(d)")
    shown = shown.replace("^", "**")
    shown = re.sub(r"(\d)([a-z(])", r"\1*\2", shown)
    shown = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", shown)
    return re.sub(r"\b(?!(?:sin|cos|tan|log|abs)\b)([A-Za-z]\w*)\(", r"\1*(", shown)


def values(slow, case):
    names = {name: getattr(math, name) for name in ("sin", "cos", "tan", "log")}
    names |= {"abs": abs, "eps": case.eps, "p": case.moments[0], "q": case.moments[2]}
    names |= {"C": case.ratio, "A": 1.0, **slow._asdict()}
    for letter in "LS":
        names |= {f"{letter}{k + 1}": part for k, part in enumerate(case.target)}
    return names


def with_abbreviations(law, names):
    """The names with all that the printed equations define, in their order."""
    for line in text.EQUATIONS[law]:
        left, _, right = line.partition(" = ")
        names[left] = eval(in_python(right), {"__builtins__": {}}, names)
    return names


@pytest.mark.parametrize("law", text.LAWS)
def test_the_printed_equations_are_those_that_are_integrated(law):
    case = Case(0.07, 0.8, averaged_moments(math.radians(70.0)), (0.36, -0.48, 0.8))
    slow = Slow(0.9, 0.7, 0.5, 1.1)
    names = with_abbreviations(law, values(slow, case))
    expected = EVOLUTIONS[law].rates(slow, case)
    for name in slow._fields:
        assert names[f"{name}'"] == pytest.approx(getattr(expected, name), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("law", text.LAWS)
def test_the_printed_integrals_are_those_that_are_computed(law):
    case = Case(0.07, 0.8, averaged_moments(math.radians(70.0)), (0.36, -0.48, 0.8))
    slow = Slow(0.9, 0.7, 0.5, 1.1)
    names = with_abbreviations(law, values(slow, case))
    assert text.INTEGRALS[law].keys() == EVOLUTIONS[law].integrals.keys()
    for name, formula in text.INTEGRALS[law].items():
        found = eval(in_python(formula.partition(",")[0]), {"__builtins__": {}}, names)
        expected = EVOLUTIONS[law].integrals[name](slow, case)
        assert found == pytest.approx(expected, rel=1e-12)


# ------------------------------------------------------------ answers


def test_b_dot_as_json(theory, strict_json):
    code, out, err = theory(*BDOT, "--rho-deg", "30", "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    radius = EARTH_RADIUS_M + 500e3
    rate, i = math.sqrt(MU_EARTH_M3_S2 / radius**3), math.radians(60.0)
    b0 = 7.812e15 / radius**3 * 0.5 * (1.0 + math.sqrt(1.0 + 3.0 * math.sin(i) ** 2))
    assert answer["orbit"]["period_s"] == pytest.approx(2.0 * math.pi / rate)
    assert answer["orbit"]["strength_nt"] == pytest.approx(1e9 * b0)
    assert answer["orbit"]["cone_deg"] == pytest.approx(math.degrees(cone_angle(i)))
    assert answer["eps"] == pytest.approx(4e4 * b0**2 / (rate * 1.2))
    momentum = math.radians(5.0) * math.sqrt(2.0 * 1.5**2 + 1.2**2)
    assert answer["satellite"]["momentum_n_m_s"] == pytest.approx(momentum)
    theta = math.acos(1.2 / math.sqrt(2.0 * 1.5**2 + 1.2**2))
    assert answer["satellite"]["theta_deg"] == pytest.approx(math.degrees(theta))
    case = Case(1.0, 0.8, averaged_moments(i))
    s = slow_time(EVOLUTIONS["bdot"], case, Slow(1.0, math.radians(30.0), 0.0, theta), 0.1)
    for turns in answer["revolutions"].values():
        assert turns == pytest.approx(s / (2.0 * math.pi * answer["eps"]), rel=1e-6)
    assert answer["seconds"]["median"] == pytest.approx(
        answer["revolutions"]["median"] * answer["orbit"]["period_s"]
    )
    (end,) = answer["tends_to"]
    assert end["description"] == "momentum across the cone axis, nutation 90 deg"
    assert end["length_rate"] < 0.0
    assert all(integral["at_start"] is not None for integral in answer["first_integrals"])
    assert all(0.0 <= integral["drift"] < 1e-9 for integral in answer["first_integrals"])
    assert answer["course_revolutions"] == pytest.approx(1.3 * answer["revolutions"]["median"])


def test_b_dot_in_text(theory):
    code, out, err = theory(*BDOT)
    assert (code, err) == (0, "")
    assert "eps = k B0^2/(omega0 C) = 0.03409" in out
    assert re.search(
        r"angular momentum to 10 %: 15\.\d to 22\.\d revolutions by direction, median 21", out
    )
    assert "  momentum across the cone axis, nutation 90 deg" in out
    assert "  rho' = eps (3p - 1) sin rho cos rho g" in out
    low = theory("bdot", "--inclination-deg", "30", *BDOT[3:])[1]
    assert "  momentum along the cone axis, nutation 90 deg" in low


def test_the_strength_stands_for_the_altitude_and_back(theory, strict_json):
    by_height = strict_json(theory(*BDOT, "--json")[1])
    strength = repr(by_height["orbit"]["strength_nt"])
    given = ("bdot", "--inclination-deg", "60", "--strength-nt", strength, *BDOT[5:], "--json")
    found = strict_json(theory(*given)[1])
    assert found["eps"] == pytest.approx(by_height["eps"])
    assert found["orbit"]["period_s"] == pytest.approx(by_height["orbit"]["period_s"])
    both = strict_json(theory(*BDOT, "--strength-nt", "20000", "--json")[1])
    part = (20000.0 / float(strength)) ** 2
    assert both["eps"] == pytest.approx(by_height["eps"] * part)


@pytest.mark.parametrize(
    ("law", "more", "note"),
    [
        ("bdot", ("--gain", "4e6"), r"note: eps = 3\.4\d? is not small"),
        (
            "bdot",
            ("--gain", "4", "--rate-deg-s", "0.1", "0.1", "0.1"),
            r"doubtful: precession/orbital rate = 2\.5\d: must be at least 4",
        ),
        ("spin_up", ("--gain", "1e3"), "note: .*rate is the default, 5 deg/s about each axis"),
        ("reorientation", ("--gain", "1e4"), "rate is the default, 5 deg/s about the spin axis"),
        (
            "reorientation",
            ("--gain", "1e4", "--rate-deg-s", "5", "5", "5"),
            "note: .*nutation of 6[01] deg is neglected",
        ),
        (
            "bdot",
            ("--gain", "4", "--rate-deg-s", "0.18026", "0.18026", "0"),
            "note: .*near resonance: ",
        ),
    ],
)
def test_warnings(theory, law, more, note):
    code, out, _ = theory(law, *SATELLITE, *more)
    assert code == 0
    assert re.search(note, out), out


def test_a_course_that_stops_says_so(theory, strict_json):
    """Spin-up against an opposite spin about the cone axis brakes it to nothing."""
    given = ("spin_up", *SATELLITE, "--gain", "1e4", "--rate-deg-s", "0", "0", "-5")
    answer = strict_json(theory(*given, "--rho-deg", "0", "--revolutions", "4", "--json")[1])
    eps, p = answer["eps"], answer["orbit"]["p"]
    stops = re.search(r"^stops at u = (\S+): the motion leaves the domain", answer["notes"][0])
    assert float(stops[1]) == pytest.approx(1.0 / (2.0 * p * eps), rel=1e-5)
    assert all(integral["drift"] is None for integral in answer["first_integrals"])  # infinite


def test_the_drift_is_printed(theory):
    out = theory(*BDOT, "--rho-deg", "30")[1]
    assert "first integrals (drift in units of l and radians over " in out
    drift = re.search(r"2p ln tan rho = \S+; drift (\S+)", out)
    assert drift and float(drift[1]) < 1e-13


def test_reorientation_to_target_on_the_axis_stays_at_rest(theory, strict_json):
    given = ("reorientation", *SATELLITE, "--gain", "1e4", "--rate-deg-s", "0", "0", "5")
    answer = strict_json(theory(*given, "--rho-deg", "0", "--json")[1])
    assert answer["notes"] == [] and answer["revolutions"]["median"] == 0.0


def test_pictures(theory, tmp_path):
    for given in (BDOT, ("preliminary_2", *SATELLITE, "--gain", "1e4", "--rho-deg", "40")):
        code, out, _ = theory(*given, "--revolutions", "6", "--out", tmp_path / given[0])
        assert code == 0
        for name in ("evolution.png", "map.png"):
            path = tmp_path / given[0] / name
            assert str(path) in out
            assert np.ptp(matplotlib.image.imread(path)[..., :3]) > 0.5


def test_latex(theory, monkeypatch):
    pytest.importorskip("sympy")
    code, out, err = theory("nutation_damping", *SATELLITE, "--gain", "4e4", "--latex")
    assert (code, err) == (0, "")
    assert r"\begin{aligned}" in out and r"\theta' &=" in out and r"\omega_{0}" in out
    code, out, _ = theory("reorientation", *SATELLITE, "--gain", "4e4", "--latex")
    assert code == 0 and r"\rho' &= - \frac{B_{0}^{2} k p \sin {\rho}}{l \omega_{0}}" in out
    monkeypatch.setitem(sys.modules, "torquer.theory.averaged.latex", None)
    code, out, err = theory(*BDOT, "--latex")
    assert (code, out) == (2, "")
    assert err.startswith("error: --latex: needs sympy: pip install 'torquer[symbolic]'")


# ------------------------------------------------------------ design


def test_design_table_and_its_inverse(theory, strict_json):
    asked = ("nutation_damping", *SATELLITE, "--design", "--to", "5")
    code, out, err = theory(*asked, "--revolutions", "8", "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    assert [row["eps"] for row in answer["rows"]] == pytest.approx([0.003, 0.01, 0.03, 0.1, 0.3])
    worst = answer["gain_for_it"]["greatest"]
    back = strict_json(theory(*asked, "--gain", repr(worst), "--json")[1])
    assert back["rows"][3]["gain"] == pytest.approx(worst)
    assert back["rows"][3]["revolutions"]["greatest"] == pytest.approx(8.0)
    assert back["gain_for_it"] is None
    shown = theory(*asked, "--revolutions", "8")[1].splitlines()
    titles = ["gain", "A", "m^2", "s/T", "eps", "min", "median", "max", "flown"]
    assert shown[1].split() == titles
    assert shown[7].startswith(f"8 revolutions: gain {worst:.4g} A m^2 s/T for the slowest")


def test_what_never_comes_is_said(theory):
    given = ("preliminary_1", "--inclination-deg", "0", *SATELLITE[2:], "--design")
    code, out, _ = theory(*given, "--revolutions", "5")
    assert code == 0
    assert out.splitlines()[2].split()[2:] == [*["never"] * 3, "?"]
    assert "gain none A m^2/T for the slowest" in out


# ------------------------------------------------------------ scenarios


def test_a_scenario_gives_what_the_options_do(scenario, theory, strict_json):
    path = scenario('kind = "bdot", gain_a_m2_s_per_t = 4e4')
    found = strict_json(theory("--scenario", path, "--json")[1])
    options = strict_json(theory(*BDOT, "--json")[1])
    assert found["eps"] == pytest.approx(options["eps"], rel=1e-9)
    assert found["satellite"]["theta_deg"] == pytest.approx(options["satellite"]["theta_deg"])
    assert options["satellite"]["rho_deg"] is None
    # the momentum lies in Y at (cos, sin) of the node; Z3 = (0, -sin Theta, cos Theta)
    momentum = np.array([1.5, 1.5, 1.2]) / np.linalg.norm([1.5, 1.5, 1.2])
    node = math.radians(40.0)
    second = -math.sin(node) * momentum[0] + math.cos(node) * momentum[1]
    cone = cone_angle(math.radians(60.0))
    rho = math.acos(math.cos(cone) * momentum[2] - math.sin(cone) * second)
    assert found["satellite"]["rho_deg"] == pytest.approx(math.degrees(rho))


def test_a_measurement_window_takes_its_part_of_the_gain(scenario, theory):
    path = scenario('kind = "bdot", gain_a_m2_s_per_t = 3e8', "5, 5, 5",
                    "measure_s = 6.0\nactuate_s = 3.0")  # fmt: skip
    code, out, _ = theory("--scenario", path)
    assert code == 0
    assert "gain 1e+08 A m^2 s/T" in out
    assert "note: the coils are on 33 % of the time: effective gain 1e+08" in out
    assert re.search(
        r"note: the law initially commands [\d.e+]+ A m\^2 from coils limited to 300", out
    )


def test_what_sampling_and_lag_allow(theory, scenario, strict_json):
    _, out, _ = theory(*BDOT, "--sample-s", "2", "--lag-s", "0.5", "--json")
    answer = strict_json(out)["sampling"]
    rate = math.radians(5.0) * math.sqrt(3.0)
    assert answer["limit_deg_s"] == pytest.approx(math.degrees(sampling_limit_rad_s(2.0, 2.0, 0.5)))
    assert answer["rate_deg_s"] == pytest.approx(math.degrees(rate))
    assert answer["efficiency"] == pytest.approx(damping_efficiency(rate, 2.0, 2.0, 0.5))
    b0 = 1e-9 * strict_json(out)["orbit"]["strength_nt"]
    assert answer["greatest_gain"] == pytest.approx(bdot_greatest_gain(1.2, b0, 2.0, lag_s=0.5))
    assert strict_json(theory(*BDOT, "--json")[1])["sampling"] is None
    text_out = theory(*BDOT, "--sample-s", "2", "--lag-s", "0.5", "--design")[1]
    assert "held for 2 s by coils with a lag of 0.5 s it damps rotation up to 36.2" in text_out
    path = scenario('kind = "bdot_rate", gain_a_m2_s_per_t = 3e6', "0, 0, 70",
                    "measure_s = 6.0\nactuate_s = 3.0")  # fmt: skip
    _, out, _ = theory("--scenario", path)
    assert "with readings held for 3 s it damps rotation up to 60 deg/s" in out
    assert "note: the sampled law does not damp the initial rate" in out


def test_sampled_nutation_damping_is_asked_of_its_precession(theory, strict_json):
    given = ("nutation_damping", *BDOT[1:-3], "0", "0", "100", "--sample-s", "2", "--json")
    answer = strict_json(theory(*given)[1])["sampling"]
    assert answer["rate_deg_s"] == pytest.approx(100.0 * 1.2 / 1.5)  # L/A
    assert answer["greatest_gain"] is None


def test_targets_of_scenarios(scenario):
    i, node = math.radians(60.0), math.radians(40.0)
    cone, away = cone_angle(i), 'kind = "preliminary_1", gain_a_m2_per_t = 1e4, target = '
    asked = case_from_scenario(load_scenario(scenario(away + '"sun"')))
    assert re.search(r"target is \d+ deg from the cone axis", asked.notes[-1])
    axis = [math.sin(cone) * math.sin(node), -math.sin(cone) * math.cos(node), math.cos(cone)]
    asked = case_from_scenario(load_scenario(scenario(away + str(axis))))
    assert asked.notes == ()
    law = (
        'kind = "reorientation", gain_a_m2_per_n_m_s_t = 1e4, momentum_n_m_s = 0.2, '
        f"inertia_kg_m2 = [1.5, 1.5, 1.2], target = {[math.cos(node), math.sin(node), 0.0]}"
    )
    path = scenario(law, "0, 0, 5")
    asked = case_from_scenario(load_scenario(path))
    length = 0.2 / (1.2 * math.radians(5.0))
    assert asked.target == pytest.approx((length, 0.0, 0.0), abs=1e-12)
    # the Sun fixed in that direction is the same target
    text = path.read_text().replace(law[law.index("target") :], 'target = "sun" ')
    fixed = f"\nsun_direction = {[math.cos(node), math.sin(node), 0.0]}\nearth_rotation"
    path.write_text(text.replace("\nearth_rotation", fixed) + "\n")
    to_sun = case_from_scenario(load_scenario(path))
    assert to_sun.target == pytest.approx((length, 0.0, 0.0), abs=1e-3)
    assert asked.notes == ()


SDOT = ("sdot", *SATELLITE, "--gain", "10", "--sun-deg", "70")


def test_s_dot_tells_direction_and_speed_of_the_momentum_turn(theory, strict_json):
    p = averaged_moments(math.radians(60.0))[0]
    q, s1, s3 = 1.0 - 2.0 * p, math.sin(math.radians(70.0)), math.cos(math.radians(70.0))
    boundary = math.degrees(math.atan2(p * s1, q * s3)) + 90.0  # normal to (p S1, p S2, q S3)
    for rho, side in ((boundary - 1.0, "towards"), (boundary + 1.0, "away from")):
        text_out = theory(*SDOT, "--rho-deg", str(rho))[1]
        assert f"the momentum turns {side} it, within 5 deg after at most " in text_out
    answer = strict_json(theory(*SDOT, "--rho-deg", "20", "--json")[1])
    r = math.radians(20.0)
    end = (p * s1 * math.sin(r) + q * s3 * math.cos(r)) / (p + (q - p) * s3**2)
    assert answer["sun"]["final_momentum"] == pytest.approx(end, rel=1e-9)
    assert answer["sun"]["gamma_deg"] == pytest.approx(50.0)
    assert [each["description"] for each in answer["tends_to"]] == [
        "momentum towards the Sun, nutation 90 deg", "momentum away from the Sun, nutation 90 deg"
    ]  # fmt: skip
    assert all(each["drift"] < 1e-9 for each in answer["first_integrals"])
    anywhere = strict_json(theory(*SDOT, "--json")[1])
    assert anywhere["sun"] is None and not any("drifts" in note for note in anywhere["notes"])


def test_s_dot_of_a_scenario_has_its_sun(scenario, theory, strict_json):
    """The direction of the Sun in Z, from that in J, by hand; both forms of the law."""
    node, cone = math.radians(40.0), cone_angle(math.radians(60.0))
    sun = np.array([0.48, -0.6, 0.64])
    x, across = sun[0] * math.cos(node) + sun[1] * math.sin(node), sun @ [
        -math.sin(node), math.cos(node), 0.0
    ]  # fmt: skip
    in_z = [x, math.cos(cone) * across + math.sin(cone) * 0.64,
            math.cos(cone) * 0.64 - math.sin(cone) * across]  # fmt: skip
    for kind in ("sdot", "sdot_rate"):
        path = scenario(f'kind = "{kind}", gain_a_m2_s = 10.0')
        fixed = f"\nsun_direction = {sun.tolist()}\nearth_rotation"
        path.write_text(path.read_text().replace("\nearth_rotation", fixed))
        asked = case_from_scenario(load_scenario(path))
        assert asked.law == "sdot" and asked.gain == 10.0
        assert asked.target == pytest.approx(in_z, abs=1e-4)  # parallax
    loud = scenario('kind = "sdot", gain_a_m2_s = 1e4')
    assert "note: the law initially commands up to" in theory("--scenario", loud)[1]


def test_the_note_on_s_dot_shows_what_is_printed(theory):
    note = (Path(__file__).parents[2] / "docs/theory/sdot.md").read_text(encoding="utf-8")
    _, command = note.split("```sh\n")
    words, _, shown = command.split("```")[:3]
    code, out, _ = theory(*words.split()[2:])
    lines = shown.strip().splitlines()
    assert code == 0 and len(lines) == 3
    assert all(f"{line}\n" in out for line in lines)


# ------------------------------------------------------------ from Python

ASKED = {
    "inclination_deg": 60.0, "altitude_km": 500.0, "inertia": (1.5, 1.5, 1.2),
    "rate_deg_s": (5.0, 5.0, 5.0),
}  # fmt: skip


def test_python_gets_the_motion_that_the_command_prints(theory, strict_json):
    found = law_motion("bdot", LawRequest(**ASKED, gain=4e4))
    assert json.loads(json_text(found.data())) == strict_json(theory(*BDOT, "--json")[1])
    assert found.lines() == theory(*BDOT)[1].splitlines()
    assert {name: len(each.axes) for name, each in plot(found).items()} == {
        "evolution": 3,
        "map": 1,
    }
    table = found._repr_html_()
    assert "<td>0.03409</td>" in table and "tends to: momentum across the cone axis" in table


def test_python_gets_the_gains_that_the_command_prints(theory, strict_json):
    words = ("bdot", *SATELLITE, "--rate-deg-s", "5", "5", "5", "--design", "--revolutions", "8")
    found = law_gains("bdot", LawRequest(**ASKED, revolutions=8.0))
    assert json.loads(json_text(found.data())) == strict_json(theory(*words, "--json")[1])
    assert found.lines() == theory(*words)[1].splitlines()
    assert found._repr_html_().count("<tr>") == 6


def test_python_gets_the_motion_of_a_scenario(scenario, theory, strict_json):
    path = scenario('kind = "bdot", gain_a_m2_s_per_t = 4e4')
    found = law_motion(scenario=load_scenario(path))
    printed = strict_json(theory("--scenario", path, "--json")[1])
    assert json.loads(json_text(found.data())) == printed


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda: LawRequest(rho_deg=181.0), "rho_deg: must lie within 0..180 deg; received 181"),
        (lambda: law_motion("bdot", LawRequest(**ASKED)),
         "gain: must be given (or scenario); received nothing"),
        (lambda: law_gains("bdot", LawRequest(**ASKED, lag_s=1.0)),
         "sample_s: must be given with lag_s; received nothing"),
        (lambda: law_gains("bdot", LawRequest(**ASKED | {"inertia": (1.0, 1.0, 3.0)})),
         "inertia: the sum of two principal moments"),
    ],
)  # fmt: skip
def test_a_mistake_in_python_names_its_key(ask, says):
    with pytest.raises(RequestError) as error:
        ask()
    assert str(error.value).startswith(says)


# ------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ((), "LAW: must be one of bdot, .*; received nothing"),
        (("sun",), "LAW: must be one of bdot, .*; received 'sun'"),
        (("sdot", *BDOT[1:]), r"--sun-deg: must be given \(or --scenario\); received nothing"),
        ((*BDOT, "--sun-deg", "60"), "--sun-deg: must be left out for bdot; received 60"),
        (("sdot", *BDOT[1:], "--sun-deg", "-1"), r"--sun-deg: must lie within 0\.\.180 deg; rec"),
        (("bdot",), "--inclination-deg: must be given .*; received nothing"),
        ((*BDOT[:9],), "--gain: must be given"),
        (("bdot", *SATELLITE[:2], *SATELLITE[4:], "--gain", "1"), "--altitude-km: it or --str"),
        ((*BDOT, "--to", "100"), "--to: must lie between 0 and 100; received 100"),
        (("spin_up", *BDOT[1:], "--to", "50"), "--to: must be above 100 for spin_up"),
        ((*BDOT, "--rho-deg", "181"), r"--rho-deg: must lie within 0\.\.180 deg; received 181"),
        ((*BDOT, "--revolutions", "0"), "--revolutions: must be a positive number; received 0"),
        ((*BDOT, "--lag-s", "0.1"), "--sample-s: must be given with --lag-s; received nothing"),
        ((*BDOT, "--sample-s", "0"), "--sample-s: must be a positive number; received 0"),
        (
            (*BDOT, "--sample-s", "1", "--lag-s", "-1"),
            "--lag-s: must be 0 or positive; received -1",
        ),
        (
            ("spin_up", *BDOT[1:], "--sample-s", "1"),
            "--sample-s: must be left out for spin_up; received 1",
        ),
        ((*BDOT, "--design", "--latex"), "--latex: must not be given with --design"),
        (("bdot", *SATELLITE, "--gain", "-1"), "--gain: must be a positive number; received -1"),
        (
            ("bdot", *SATELLITE, "--gain", "1", "--rate-deg-s", "0", "0", "0"),
            "rate: must not be zero",
        ),
        (
            ("bdot", *SATELLITE[:5], "1", "1", "3", "--gain", "1"),
            "--inertia: the sum of two principal moments",
        ),
        (
            ("bdot", *SATELLITE[:2], "--strength-nt", "90000", *SATELLITE[4:], "--gain", "1"),
            r"--strength-nt: must be below \d+ nT, its value on the ground",
        ),
        *(
            (
                ("bdot", *SATELLITE[:2], *answer, *SATELLITE[4:], "--gain", "1"),
                "orbit: must stay within 1500000 km of the Earth's centre, its Hill sphere",
            )
            for answer in (("--altitude-km", "1e30"), ("--strength-nt", "1e-8"))
        ),
    ],
)
def test_mistakes_are_one_line(theory, given, line):
    code, out, err = theory(*given)
    assert (code, out) == (2, "")
    assert re.match(f"error: {line}", err), err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("law", "more", "line"),
    [
        ('kind = "off"', (), "control.law.kind: must be one of bdot"),
        (
            'kind = "spin_up", relay_dipole_a_m2 = 0.1',
            (),
            "control.law.gain_a_m2_per_t: must be given: averaging does not cover relays",
        ),
        ('kind = "bdot", gain_a_m2_s_per_t = 4e4', ("--gain", "1"), "--gain: must not be given wi"),
        ('kind = "bdot", gain_a_m2_s_per_t = 4e4', ("spin_up",), "LAW: must be the scenario's, bd"),
    ],
)
def test_mistakes_in_scenarios_are_one_line(theory, scenario, law, more, line):
    code, out, err = theory(*more, "--scenario", scenario(law))
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {line}"), err


BDOT_LAW = 'kind = "bdot", gain_a_m2_s_per_t = 4e4'
WHEELS = """
[spacecraft.wheels]
layout = { kind = "orthogonal" }
momentum_limit_n_m_s = 1.0
torque_limit_n_m = 0.1
"""
HOLD = 'hold = { kind = "wheel_pd", bandwidth_rad_s = 0.01, inertia_kg_m2 = [1.5, 1.5, 1.2] }'


def in_laws(path, more):
    """The scenario with its law in a table of laws, beside others."""
    text, law = path.read_text(), "law = { " + BDOT_LAW + " }\n"
    assert law in text
    laws = "[control.laws]\ncoils = { " + BDOT_LAW + " }\n" + more
    path.write_text(text.replace(law, laws))
    return path


def test_coil_law_is_averaged_the_same_beside_a_wheel_law(theory, scenario):
    alone = theory("--scenario", scenario(BDOT_LAW))[1]
    code, out, err = theory("--scenario", in_laws(scenario(BDOT_LAW), HOLD + WHEELS))
    assert (code, err, out) == (0, "", alone)


@pytest.mark.parametrize(
    ("more", "received"),
    [
        ("again = { " + BDOT_LAW + " }", "2 laws of the coils"),
        ('[control.modes.states.only]\nlaws = ["coils"]', "modes or a scheme"),
    ],
)
def test_only_one_law_that_always_works_can_be_averaged(theory, scenario, more, received):
    code, out, err = theory("--scenario", in_laws(scenario(BDOT_LAW), more + "\n"))
    assert (code, out) == (2, "")
    assert err == f"error: control.law: must be one law to be averaged; received {received}\n"


def test_help(theory):
    code, out, _ = theory("--help")
    assert not code
    assert "--inclination-deg" in out and "preliminary_1" in out
