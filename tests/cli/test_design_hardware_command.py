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
