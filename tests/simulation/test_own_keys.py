"""Mistakes in the user's own parts that are found before the flight: one line with the key."""

import re

import numpy as np
import pytest
from own_parts import (
    AIR,
    BEGINS,
    BRIEF,
    CONTROLS,
    DRAG,
    FIELD,
    FILES,
    NAMES,
    OFF,
    PARTS,
    RING,
    SENSOR,
    TEXT,
    compiled_only,
    made,
    message,
    put,
    scenario_maker,
    whole_runs,
    write,
)

from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import campaign_from_data, check_own_parts
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.scenario.load import check_orbit_environment
from torquer.simulation.setup.simulate import simulate
from torquer.simulation.setup.usable import checked_size


@pytest.fixture
def scenario(tmp_path):
    """A function that makes the scenario of some lines, beside files of parts."""
    return scenario_maker(tmp_path)


# ------------------------------------------------------------------ parameters


@pytest.mark.parametrize("key", PARTS)
def test_a_parameter_that_the_function_has_not_is_named(scenario, key):
    found = message(simulate, made(scenario, key, "parameters = { k = 1.0 }"))
    assert re.match(rf"{re.escape(key)}\.parameters\.k: must be one of the function's \(", found)
    assert found.endswith("; received 'k'")


@pytest.mark.parametrize("key", PARTS)
def test_a_check_without_a_flight_finds_it_too(scenario, key):
    wrong = made(scenario, key, "parameters = { k = 1.0 }")
    assert message(checked_size, wrong).startswith(f"{key}.parameters.k: must be one of the ")


@pytest.mark.parametrize("key", (*PARTS, "control.estimator", "control.law"))
def test_a_campaign_that_varies_what_is_no_parameter_does_not_start(scenario, key):
    """All members failed, and no line on the screen said why."""
    flown = made(scenario, key)
    vary = {f"{key}.parameters.nothing": {"uniform": [1.0, 2.0]}}
    found = message(check_own_parts, campaign_from_data({"runs": 2, "vary": vary}, flown), flown)
    assert found.startswith(f'campaign.vary."{key}.parameters.nothing": must be one of')
    assert found.endswith("; received 'nothing'")
    name = {"control.estimator": "share", "control.law": "gain"}.get(key)
    name = name or PARTS[key][4].split("=")[0]
    vary = {f"{key}.parameters.{name}": {"uniform": [1.0, 2.0]}}
    check_own_parts(campaign_from_data({"runs": 2, "vary": vary}, flown), flown)


@pytest.mark.parametrize("key", PARTS)
def test_what_is_no_parameter_but_an_argument_is_not_given(scenario, key):
    first = PARTS[key][3].split(", ")[0]
    found = message(simulate, made(scenario, key, f"parameters = {{ {first} = 1.0 }}"))
    assert found.startswith(f"{key}.parameters.{first}: must be one of the function's (")


@pytest.mark.parametrize("key", PARTS)
def test_a_parameter_without_a_default_must_be_given(scenario, tmp_path, key):
    """And takes its own place: a torque once got the next parameter's number for it."""
    _, _, name, arguments, first = PARTS[key]
    file = put(tmp_path, key, f"{arguments}, {first}", f"{arguments}, k, {first}")
    found = message(simulate, made(scenario, key))
    assert found == (
        f"{key}.parameters.k: must be given, as the function has no default for it; received "
        f"nothing ({name} in {file})"
    )


@whole_runs
@pytest.mark.parametrize("key", PARTS)
def test_a_parameter_that_is_given_needs_no_default(scenario, tmp_path, key):
    _, _, _, arguments, first = PARTS[key]
    name, value = first.split("=")
    usual = simulate(made(scenario, key))
    put(tmp_path, key, f"{arguments}, {first}", f"{arguments}, {name}")
    again = simulate(made(scenario, key, f"parameters = {{ {name} = {value} }}"))
    assert np.array_equal(usual["q_body_to_inertial"], again["q_body_to_inertial"])


@pytest.mark.parametrize("key", PARTS)
def test_parameters_that_only_a_name_gives_are_for_plain_python(scenario, tmp_path, key):
    _, _, _, arguments, first = PARTS[key]
    put(tmp_path, key, f"{arguments}, {first}", f"{arguments}, *, {first}")
    if key in ("disturbance.own.leak", "spacecraft.own_sensor"):
        found = message(simulate, made(scenario, key))
        assert "; received one with parameters after * (" in found
    else:
        simulate(made(scenario, key))


@pytest.mark.parametrize("key", PARTS)
def test_a_function_takes_its_arguments(scenario, tmp_path, key):
    _, _, name, arguments, _ = PARTS[key]
    file = write(tmp_path, f"def {name}():\n    return 1.0\n")
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}: must be a function ({arguments}) that ")
    assert found.endswith(f"; received one that takes none of these arguments ({name} in {file})")


@pytest.mark.parametrize("value", ("None", "'a'", "True", "float('nan')", "1e400"))
@pytest.mark.parametrize("key", ("disturbance.own.leak", "spacecraft.own_sensor"))
def test_a_default_of_what_is_compiled_is_a_finite_number(scenario, tmp_path, key, value):
    _, _, _, arguments, first = PARTS[key]
    parameter = first.split("=")[0]
    put(tmp_path, key, f"{arguments}, {first}", f"{arguments}, {parameter}={value}")
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}.parameters.{parameter}: must be a finite number, by default, ")


@pytest.mark.parametrize("key", ("control.estimator", "control.law"))
@pytest.mark.parametrize(
    ("more", "expected"),
    (
        ("parameters = { k = 1.0 }", ".parameters.k: must be one of: {0}; received 'k'"),
        (
            "parameters = { {0} = [1.0, 2.0] }",
            ".parameters.{0}: must be a number; received (1.0, 2.0)",
        ),
        ("memory = [1.0]", ".memory: must have 3 cells, as the block has; received 1"),
        ("function = 'nothing'", ".function: must be defined in the file; received 'nothing', "),
    ),
)
def test_keys_of_estimators_and_laws_are_named(scenario, key, more, expected):
    name = {"control.estimator": "share", "control.law": "gain"}[key]
    found = message(simulate, made(scenario, key, more.replace("{0}", name)))
    assert found.startswith(key + expected.replace("{0}", name))


@pytest.mark.parametrize("key", ("control.estimator", "control.law"))
def test_what_reads_the_own_sensor_needs_one(scenario, tmp_path, key):
    """It once read zeros."""
    begins, name = BEGINS[key], {"control.law": "mine", "control.estimator": "calm"}[key]
    line = "    x, y, z = inputs.own_reading\n"
    file = put(tmp_path, key, begins, begins if begins in line else line + begins)
    assert message(checked_size, scenario(control=CONTROLS[key])) == (
        f"spacecraft.own_sensor: must be given for {key} ({name}), which reads own_reading; "
        "received none"
    )
    checked_size(scenario(SENSOR, control=CONTROLS[key]))
    text = file.read_text()
    file.write_text(text.replace(line, f"{line}    when = inputs.read_at.own_sensor_s\n"))
    checked_size(scenario(control=CONTROLS[key]))


# ------------------------------------------------------------------ files


@pytest.mark.parametrize("key", (*PARTS, "control.estimator", "control.law"))
@pytest.mark.parametrize(
    ("text", "expected"),
    (
        ("1 / 0\n", "must import; received ZeroDivisionError('division by zero') ({file}, line 1)"),
        ("\n\ndef (:\n", "must import; received SyntaxError('invalid syntax') ({file}, line 3)"),
        ("raise SystemExit(4)\n", "must import; received SystemExit(4) ({file}, line 1)"),
        ("import nothing_of_the_kind\n", "must import; received ModuleNotFoundError("),
    ),
)
def test_a_file_that_does_not_import_is_named(scenario, tmp_path, key, text, expected):
    found_scenario, name = made(scenario, key), FILES.get(key, ("own.py",))[0]
    (tmp_path / name).write_text(text)
    found = message(simulate, found_scenario)
    assert found.startswith(f"{key}.file: " + expected.format(file=tmp_path / name))


@pytest.mark.parametrize("key", (*PARTS, "control.estimator", "control.law"))
def test_a_file_that_is_not_there_is_named(scenario, tmp_path, key):
    found_scenario, name = made(scenario, key), FILES.get(key, ("own.py",))[0]
    (tmp_path / name).unlink()
    found = message(simulate, found_scenario)
    assert found == f"{key}.file: must be an existing file; received {tmp_path / name}"


@pytest.mark.parametrize("key", PARTS)
def test_a_function_that_is_not_in_the_file_is_named(scenario, tmp_path, key):
    name = PARTS[key][2]
    found_scenario, file = made(scenario, key), put(tmp_path, key, f"def {name}(", "def other(")
    assert message(simulate, found_scenario) == (
        f"{key}.function: must be a function of the file; received {name!r}, which is none of "
        f"{file}"
    )


@pytest.mark.parametrize("key", PARTS)
def test_one_of_several_functions_is_to_be_named(scenario, tmp_path, key):
    line, others, name, *_ = PARTS[key]
    unnamed = re.sub(rf", function = [\"']{name}[\"']", "", line)
    found = message(simulate, scenario(unnamed, *others))
    assert found.startswith(f"{key}.file: must define one function, or `function` name one; rec")


# ------------------------------------------------------------------ surroundings

WRONG = (
    ("orbit", "a = 1e3 * radius_km", "a = radius_km", "of an orbit about the Earth; received 6928"),
    ("orbit", "a * n * v", "2.0 * a * n * v", "about the Earth; received 6.92814e+06 m"),
    ("orbit", "return a * r, a * n * v", "return a * r, 1e-3 * a * n * v",
     ", those of these positions; received velocities off by 99.9 % from t = 0 s on (another unit"),
    ("orbit", "return a * r, a * n * v", "return a * r, -a * n * v", "velocities off by 200 %"),
    ("orbit", "return a * r, a * n * v", "return a * r, 0.0 * v", "velocities off by 100 %"),
    ("orbit", "u, i = n * t_s", "u, i = 0.9 * n * t_s",
     ", that move under gravity in axes J; received accelerations off by 19 % from t = 0 s on"),
    ("orbit", "return a * r, a * n * v", "return {}, {}", "received {}"),
    ("orbit", "return a * r, a * n * v", "return 'a', v", "received 'a'"),
    ("orbit", "return a * r, a * n * v", "return r + 0j, v", "received array"),
    ("orbit", "return a * r, a * n * v", "return a * r", "received ndarray"),
    ("orbit", "return a * r, a * n * v", "return None", "received NoneType"),
    ("orbit", "return a * r, a * n * v", "return a * r[:2], v", "shape (2, 3) for n = "),
    ("orbit", "return a * r, a * n * v", "return r * np.nan, v", "finite; received [nan, nan"),
    ("orbit", "return a * r, a * n * v", "return nothing", "received NameError"),
    ("orbit", "return a * r, a * n * v", "raise SystemExit(3)", "SystemExit(3) at t = 0 s"),
    ("environment.field", "-7.8e15]", "-7.8e24]", "(in nT?)"),
    ("environment.field", "- moment) / distance**3", "- moment)[0]", "shape (3,) for n = "),
    ("environment.field", "- moment) / distance**3", "- moment) * np.inf", "received [-inf"),
    ("environment.field", "- moment) / distance**3", "- moment) / nothing", "2025-07-01T00:00:00Z"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "{}", "received {}"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "-1.0", "received shape () for"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "-np.ones(len(r_ecef_m))",
     "not negative; received -1.0 at t = 0 s"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "np.full(len(years), np.inf)",
     "finite and not negative; received inf at t = 0 s"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "np.full(len(years), 5e-4)",
     ", at most 1e-06 130 km or more above the Earth; received 0.0005 (in kg/km^3?) at t = 0 s"),
    ("environment.atmosphere", "np.full(len(r_ecef_m), density)", "density + nothing",
     "received NameError(\"name 'nothing' is not defined\") at ["),
)  # fmt: skip


@pytest.mark.parametrize(("key", "text", "by", "expected"), WRONG)
def test_what_surroundings_do_wrong_is_one_line(scenario, tmp_path, key, text, by, expected):
    file = put(tmp_path, key, text, by)
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}: must be a function (")
    assert expected in found and re.search(rf"\({NAMES[key]} in {re.escape(str(file))}", found)


ROUND = {"revolutions": 1, "record_s": 60.0}


@pytest.mark.parametrize(("axes", "turned"), (("ECEF", True), ("GCRF", False)))
def test_positions_in_other_axes_than_those_stated_do_not_fall(scenario, axes, turned):
    """A circle of inertial axes, as one that turns with the Earth: Coriolis' acceleration.

    2 w v sin u of mu/r^2, of which 13.3 % sin 36 deg is the median of five places: 7.8 %.
    """
    wrong = scenario(RING.replace('"J"', f'"{axes}"')).replace("simulation", ROUND)
    if turned:
        found = message(check_orbit_environment, wrong)
        off = re.search(r"gravity in axes ECEF; received accelerations off by ([\d.]+) % ", found)
        assert float(off[1]) == pytest.approx(7.8, abs=0.3)
    else:
        check_orbit_environment(wrong)


@pytest.mark.parametrize(("given", "refused"), ((95, True), (5100, True), (5200, False)))
def test_the_time_of_a_revolution_is_that_of_the_orbit(scenario, tmp_path, given, refused):
    """Minutes for seconds are found: 2 pi sqrt(a^3 / mu) is 5739 s."""
    line = RING.replace("5740", str(given))
    if not refused:
        return check_orbit_environment(scenario(line))
    assert message(check_orbit_environment, scenario(line)) == (
        "orbit.revolution_s: must be the time of a revolution to a tenth, 5739 s by position and "
        f"velocity at the start; received {given} (ring in {tmp_path / 'own.py'})"
    )


def test_an_orbit_on_board_is_checked_by_its_own_key(scenario):
    """Once "control.ephemeris" stood twice."""
    line = RING.replace("5740", "95").replace("orbit = ", "", 1)
    wrong = scenario(control=OFF.replace("}\n", f", ephemeris = {{ orbit = {line} }} }}\n"))
    found = message(check_orbit_environment, wrong)
    assert found.startswith("control.ephemeris.orbit.revolution_s: must be the time of a revol")


def test_a_thrust_disturbs_one_place_only(scenario, tmp_path):
    jump = "    v = v + 0.1 * (t_s > 5.0)[:, None] * (t_s < 15.0)[:, None] * across\n"
    put(tmp_path, "orbit", "    return a * r, a * n * v", f"{jump}    return a * r, a * n * v")
    check_orbit_environment(scenario(RING).replace("simulation", ROUND))


def test_the_time_of_a_revolution_is_that_of_the_first(scenario, tmp_path):
    """Later the satellite is 2000 km higher, and a revolution 45 % longer."""
    put(
        tmp_path, "orbit", "a = 1e3 * radius_km", "a = 1e3 * radius_km + 2e6 * (t_s[:, None] > 1e5)"
    )
    text = (tmp_path / "own.py").read_text()
    text = text.replace("u, i = n * t_s", "u, i = n[:, 0] * t_s")
    (tmp_path / "own.py").write_text(text)
    flown = scenario(RING)
    flown.orbit.check_span(flown.start, 0.0, 9e3)
    flown.orbit.check_span(flown.start, 2e5, 3e5)


def test_whole_numbers_are_numbers(scenario, tmp_path):
    text = TEXT.replace(
        "return a * r, a * n * v", "return (a * r).astype(int), (a * n * v).astype(int)"
    )
    text = text.replace("- moment) / distance**3", "- moment).astype(int) * 0")
    write(tmp_path, text.replace("np.full(len(r_ecef_m), density)", "np.zeros(len(years), int)"))
    around = scenario(RING, FIELD, AIR, DRAG).orbit_environment()
    t_s = np.arange(3.0)
    r, v = around.orbit.state(t_s, around.start)
    assert r.dtype == v.dtype == np.float64 and (r == np.round(r)).all()
    assert around.field(t_s, r, v).dtype == np.float64 and (around.flow(t_s) == 0.0).all()


def test_a_field_that_jumps_is_named(scenario, tmp_path):
    jump = "(1.0 + 0.01 * (r_ecef_m[:, 2:] > 1e6)) * "
    put(tmp_path, "environment.field", "return (3.0", f"return {jump}(3.0")
    found = message(simulate, scenario(FIELD))
    assert found.startswith("environment.table_tolerance: environment table: must reach a relative")
    assert found.endswith(" s (does environment.field jump? it must be smooth)")


def test_a_field_of_nothing_is_a_field(scenario, tmp_path):
    """A relative error of 0/0 was infinite."""
    text = put(tmp_path, "environment.field", "scale=1.0", "scale=0.0").read_text()
    assert "scale=0.0" in text
    found = simulate(made(scenario, "environment.field"))
    assert not found["b_inertial"].values.any() and float(found.table_relative_error) < 1e-9


def test_parts_of_the_ephemeris_have_its_key(scenario, tmp_path):
    put(tmp_path, "environment.field", "- moment) / distance**3", "- moment) * np.nan")
    line = FIELD.replace("environment.field", "field").replace("field = ", "", 1)
    found_scenario = scenario(
        control=OFF.replace("}\n", f", ephemeris = {{ field = {line} }} }}\n")
    )
    found = message(check_orbit_environment, found_scenario)
    assert found.startswith("control.ephemeris.field: must be a function (r_ecef_m, years) that ")


# ------------------------------------------------------------------ what is compiled

NOT_COMPILED = (
    ("return (0.0, 0.0)", "received one that returns a tuple of 2 numbers ("),
    ("return (0.0, 0.0, 0.0, 0.0)", "received one that returns a tuple of 4 numbers ("),
    ("return 0.0", "received one that returns a number ("),
    ("a = 1.0", "received one that returns nothing ("),
    ("raise ValueError('boom')", "received one that returns nothing ("),
    ("return ('a', 'b', 'c')", "received one that returns "),
    ("return (True, 0.0, 0.0)", "received one that returns Tuple(True, number, number) ("),
    ("return (1j, 0.0, 0.0)", "received one that returns Tuple(complex, number, number) ("),
    ("return (nothing, 0.0, 0.0)", "NameError"),
    ("return (here.nothing, 0.0, 0.0)", "Inputs without a field 'nothing' (own.py, line "),
    ("return open('x')", "open, which cannot be compiled (own.py, line "),
    ("return np.linalg.nothing(1.0)", "no attribute 'nothing'"),
    ("yield (0.0, 0.0, 0.0)", "received a generator or coroutine ("),
    ("return here.t_s > 3.0 and (0.0, 0.0, 0.0)", "received"),
)


@compiled_only
@pytest.mark.parametrize(("body", "expected"), NOT_COMPILED)
@pytest.mark.parametrize("key", ("disturbance.own.leak", "spacecraft.own_sensor"))
def test_what_cannot_be_compiled_is_one_line(scenario, tmp_path, key, body, expected):
    name = NAMES[key]
    file = write(tmp_path, f"import numpy as np\n\n\ndef {name}(here, gain=1.0):\n    {body}\n")
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}: must be a function (here) that compiles and returns three num")
    assert expected in found and found.endswith(f"({name} in {file})")
    assert len(found) < 600 and "numba" not in found.lower()


@compiled_only
def test_a_function_that_takes_any_keywords_is_not_compiled(scenario, tmp_path):
    put(tmp_path, "disturbance.own.leak", "growth=0.0)", "growth=0.0, **rest)")
    found = message(simulate, made(scenario, "disturbance.own.leak"))
    assert "received one that takes keywords without their names (**)" in found


@pytest.mark.parametrize("key", ("disturbance.own.leak", "spacecraft.own_sensor"))
def test_there_are_twelve_parameters_at_most(scenario, tmp_path, key):
    name, many = NAMES[key], ", ".join(f"p{k}=0.0" for k in range(13))
    write(tmp_path, f"def {name}(here, {many}):\n    return (0.0, 0.0, 0.0)\n")
    found = message(simulate, made(scenario, key))
    assert found.startswith(f"{key}.function: must have 12 or fewer parameters; received 13 (")


@compiled_only
@pytest.mark.parametrize(
    "body", ("return (0, 0, 0)", "return [0.0, 0.0, 0.0]", "return np.zeros(3)")
)
@pytest.mark.parametrize("key", ("disturbance.own.leak", "spacecraft.own_sensor"))
def test_whole_numbers_lists_and_arrays_of_three_are_answers(scenario, tmp_path, key, body):
    begin = BEGINS[key]
    usual = simulate(scenario().replace("simulation", BRIEF))
    put(tmp_path, key, begin, f"    {body}\n{begin}")
    found = simulate(made(scenario, key))
    assert np.array_equal(found["q_body_to_inertial"], usual["q_body_to_inertial"])


@compiled_only
def test_the_reason_of_members_that_fail_is_among_what_is_shown(scenario):
    flown = made(scenario, "disturbance.own.leak")
    vary = {"disturbance.own.leak.function": {"values": ["leak", "crosswise", "nothing"]}}
    refused = campaign_from_data({"runs": 3, "vary": vary}, flown)
    assert message(fly_campaign, flown, refused).startswith(
        'campaign.vary."disturbance.own.leak.function": must be a function of the file; received '
    )
    vary["disturbance.own.leak.function"]["values"].pop()
    result = fly_campaign(flown, campaign_from_data({"runs": 8, "vary": vary}, flown))
    rows = summary_rows(campaign_summary(result))
    assert rows[0] == ("Members", "8") and rows[1][0] == "Failed" and int(rows[1][1]) > 1
    assert rows[2][0].startswith("  member ")
    assert rows[2][1].startswith("disturbance.own.leak: must be a function (here) that compiles")
    assert not rows[3][0].startswith("  member ")  # one reason, one row
