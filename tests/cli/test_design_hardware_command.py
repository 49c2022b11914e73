"""`torquer design coil` and `torquer design bench`, as typed."""

import pytest

COIL = ["design", "coil", "--dipole-a-m2", "3.2", "--diameter-m", "0.3", "--mass-kg", "0.4"]
BENCH = [
    "design", "bench", "--time-s", "600", "--bench-inertia", "0.4", "--inertia", "1.6",
    "--bench-field-nt", "1e5", "--field-nt", "1e4",
]  # fmt: skip


def test_coil_prints_both_metals_and_the_gauges(call):
    code, out, err = call(*COIL, "--voltage-v", "12")
    assert (code, err) == (0, "")
    assert "copper 0.6976 W, aluminium 0.3477 W" in out
    assert out.splitlines()[-1].split()[0] == "29"


def test_coil_as_json(call, strict_json):
    data = strict_json(call(*COIL, "--metal", "aluminium", "--json")[1])
    assert data["metal"] == "aluminium"
    for coil in data["coils"]:
        assert coil["power_w"] * coil["mass_kg"] == pytest.approx(
            0.4 * data["power_w"]["aluminium"]
        )


@pytest.mark.parametrize("more", [[], ["--json"], ["--metal", "aluminium"]])
def test_a_coil_that_melts_is_refused_with_what_limits_it(call, more):
    melting = ["--dipole-a-m2", "1e4", "--diameter-m", "0.05", "--mass-kg", "0.01"]
    code, out, err = call("design", "coil", *melting, *more)
    most = "0.462" if "aluminium" in more else "0.141"
    assert code == 2 and "e+09" not in out and "9.8" not in out
    assert err.startswith(
        f"error: --dipole-a-m2: must be at most {most} A m^2 with --diameter-m = 0.05 and "
        "--mass-kg = 0.01, or the wire melts: there is no such coil; received 10000 A m^2"
    )


@pytest.mark.parametrize(
    ("option", "end"),
    [
        ("--diameter-cm", "Did you mean --diameter-m instead of --diameter-cm? 1 cm is 0.01 m"),
        ("--diameter-mm", "Did you mean --diameter-m instead of --diameter-mm? 1 mm is 0.001 m"),
        ("--diametr-m", "Did you mean --diameter-m instead of --diametr-m?"),
        ("--diameter-m2", "parameter --diameter-m requires an argument."),
    ],
)
def test_an_option_in_another_unit_is_answered_by_the_conversion(call, option, end):
    given = [option if each == "--diameter-m" else each for each in COIL]
    code, _, err = call(*given)
    assert code == 2 and err.rstrip().endswith(end)


@pytest.mark.parametrize(
    ("option", "end"),
    [
        ("--voltage-mv", ": must be a known option (did you mean --voltage-v? 1 mV is 0.001 V)"),
        ("--current-ma", ": must be a known option (did you mean --current-a? 1 mA is 0.001 A)"),
        ("--current-v", ": must be a known option; --help lists them"),
    ],
)
def test_an_unknown_option_in_another_unit_too(call, option, end):
    code, _, err = call(*COIL, option, "5")
    assert code == 2 and err == f"error: {option}{end}\n"


def test_bench_gives_the_time_of_the_text(call, strict_json):
    assert "coils at their limits: 40 times as long, 400 min in orbit" in call(*BENCH)[1]
    times = strict_json(call(*BENCH, "--json")[1])["time_s"]
    assert times["saturated"] == pytest.approx(24000.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    (
        ([*COIL, "--voltage-v", "0.001"], "--voltage-v, --current-a: must allow one of AWG 10"),
        ([*COIL, "--temperature-c", "900"], "--temperature-c: must lie within -100..200"),
        ([*COIL[:-1], "-1"], "--mass-kg: must be a positive number; received -1"),
        ([*BENCH[:-1], "0"], "--field-nt: must be a positive number; received 0"),
    ),
)
def test_mistakes_are_one_line(arguments, message, call):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert message in err and len(err.strip().splitlines()) == 1
