"""The trim finds the residual dipole in flight, under any law, and keeps its bounds."""

import math
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed
from law_cases import compiled, inputs
from scipy.spatial.transform import Rotation
from simulation.lanes.test_lanes import fly_both

import torquer
from torquer.analysis.attitude import find_attitude_error
from torquer.campaign.fly import fly_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.compile import engine
from torquer.computer.laws.dipole_trim import DipoleTrim

EXAMPLE = torquer.load_scenario(Path(torquer.__file__).parents[1] / "examples/residual_dipole.toml")
RESIDUAL = np.array(EXAMPLE.spacecraft.coils.residual_dipole_a_m2)
LAWS = {name: law.model_dump(mode="json") for name, law in EXAMPLE.control.laws.items()}
PERIOD_S = EXAMPLE.orbit.period_s
#: Constant matrices about as stiff as the periodic regulator of `torquer design three-axis`.
STIFF = {
    "kind": "periodic_gains",
    "rate_gains_n_m_s_per_t2": [[[3.5e5, 0.0, 0.0], [0.0, 3.3e5, 0.0], [0.0, 0.0, 6.9e5]]],
    "angle_gains_n_m_per_t2": [[[147.0, 0.0, 0.0], [0.0, 173.0, 0.0], [0.0, 0.0, 353.0]]],
}
KEYS = {"inertia_kg_m2": [0.04, 0.05, 0.03], "time_constant_s": 800.0, "greatest_dipole_a_m2": 0.02}


def flown(scenario=EXAMPLE, revolutions=6, **laws):
    """A flight with these laws, in steps of the control."""
    scenario = scenario.replace("control.laws", laws)
    return torquer.simulate(scenario.replace("simulation.revolutions", revolutions))


def late_error_deg(result) -> float:
    """Greatest error over the last revolution."""
    error = find_attitude_error(result).angle_deg
    return float(np.max(error[result.time.values > result.time.values[-1] - PERIOD_S]))


def estimates(result, name="trim") -> np.ndarray:
    return result[f"{name}.residual_dipole_a_m2"].values


@pytest.mark.parametrize("hold", [LAWS["hold"], STIFF], ids=["three_axis", "matrices"])
def test_a_hold_that_the_dipole_breaks_is_held(hold):
    assert late_error_deg(flown(hold=hold)) > 30.0
    trimmed = flown(hold=hold, trim=LAWS["trim"])
    assert late_error_deg(trimmed) < 10.0
    found = estimates(trimmed)[trimmed.time.values > 4.0 * PERIOD_S]
    assert np.abs(found - RESIDUAL).max() < 0.2 * RESIDUAL.max()


@pytest.mark.parametrize("factors", [(1.1, 1.1, 0.9), (0.9, 0.9, 1.1)])
def test_moments_that_are_a_tenth_wrong_do_not_matter(factors):
    known = (np.diagonal(np.array(LAWS["trim"]["inertia_kg_m2"])) * factors).tolist()
    trim = LAWS["trim"] | {"inertia_kg_m2": known}
    assert late_error_deg(flown(hold=LAWS["hold"], trim=trim)) < 10.0


@pytest.mark.parametrize("rate_deg_s", [(1.0, -0.6, 0.8), (0.02, 0.05, -0.03)])
def test_the_dipole_is_found_while_the_satellite_tumbles_and_brakes(rate_deg_s):
    scenario = EXAMPLE.replace("initial.rate_deg_s", rate_deg_s)
    scenario = scenario.replace("mission", None)
    braking = {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}
    found = estimates(flown(scenario, 3, braking=braking, trim=LAWS["trim"]))[-1]
    assert found == pytest.approx(RESIDUAL, abs=0.1 * RESIDUAL.max())


def test_without_readings_it_keeps_what_it_knows():
    """The magnetometer is lost for most of a revolution: no command, then the hold comes back."""
    lost = {"kind": "nan", "from_s": 4.0 * PERIOD_S, "until_s": 4.7 * PERIOD_S}
    scenario = EXAMPLE.replace("spacecraft.magnetometer.failures", [lost])
    result = flown(scenario, 9, hold=LAWS["hold"], trim=LAWS["trim"])
    found, t = estimates(result), result.time.values
    during = found[(t > 4.05 * PERIOD_S) & (t < 4.65 * PERIOD_S)]
    assert np.isfinite(found).all() and (during == during[0]).all()
    assert found[-1] == pytest.approx(RESIDUAL, abs=0.2 * RESIDUAL.max())


# the law by hand


def called(spec, rows):
    """Answers `[n, 3]` and the estimates `[n, 3]` after each."""
    law = spec.law()
    function, cells = compiled(law), law.first_memory()
    at = law.memory_places()["residual_dipole_a_m2"][0]
    found = []
    for row in rows:
        command = function(row, law.pack(), cells)
        found.append([*command.dipole_a_m2, *cells[at : at + 3]])
    return np.split(np.array(found), 2, axis=1)


def wild(n=40, seed=5, first_s=0.0, step_s=3.5):
    rng = np.random.default_rng(seed)
    return [
        inputs(
            first_s + step_s * k, b=3e-5 * rng.normal(size=3), omega=0.1 * rng.normal(size=3),
            q=Rotation.random(random_state=k).as_quat(), r=(7e6, 0.0, 0.0), v=(0.0, 7.5e3, 0.0),
            coils=0.1 * rng.normal(size=3),
        )
        for k in range(n)
    ]  # fmt: skip


@pytest.mark.parametrize("duty", [1.0, 0.5])
def test_the_estimate_keeps_its_limit_and_is_asked_for_over_the_duty(duty):
    asked, found = called(DipoleTrim(**KEYS, coil_duty=duty), wild())
    sizes = np.linalg.norm(found, axis=1)
    assert sizes.max() == pytest.approx(KEYS["greatest_dipole_a_m2"], rel=1e-12)
    assert asked == pytest.approx(-found / duty, rel=1e-15)


def test_a_gap_keeps_the_estimate_and_forgets_the_momentum():
    """16 times the gap is more than T; a clock that went back is a gap, too."""
    spec = DipoleTrim(**KEYS)
    for first_s in (39 * 3.5 + 51.0, -1e3):
        rows = [*wild(), *wild(2, seed=8, first_s=first_s)]
        _, found = called(spec, rows)
        assert (found[40] == found[39]).all() and (found[41] != found[40]).any()
    _, found = called(spec, [*wild(), *wild(1, seed=8, first_s=39 * 3.5 + 49.0)])
    assert (found[40] != found[39]).any()


@pytest.mark.parametrize("size", [1e160, 1e300])
def test_numbers_beyond_all_measure_leave_no_trace(size):
    spec, rows = DipoleTrim(**KEYS), wild(6)
    huge = rows[3]._replace(coil_dipole_body_a_m2=(size, -size, size), b_body_t=(size, 0.0, size))
    asked, found = called(spec, [*rows[:3], huge, *rows[4:]])
    assert np.isfinite(asked).all() and np.linalg.norm(found, axis=1).max() <= 0.02 * (1 + 1e-12)


def test_an_isolated_body_shows_its_dipole_step_by_step():
    """Against Euler's equations in the simplest case: a body at rest that its dipole begins to
    turn about a fixed field. Across the field the estimate obeys e'' + l e' + (l/T) e = 0 with its
    error e, about 1 - exp(-t/T); along the field there is none."""
    j, t_const, field, dipole, dt = 0.04, 800.0, 3e-5, 1e-3, 1.0
    spec = DipoleTrim(inertia_kg_m2=[j] * 3, time_constant_s=t_const, greatest_dipole_a_m2=1.0)
    rows = [
        inputs(
            k * dt, b=(0.0, 0.0, field), omega=(0.0, -dipole * field * k * dt / j, 0.0),
            r=(1e12, 0.0, 0.0), v=(0.0, 1.0, 0.0),
        )
        for k in range(3000)
    ]  # fmt: skip
    _, found = called(spec, rows)
    rate = 16.0 / t_const
    slow, fast = np.sort(np.roots([1.0, rate, rate / t_const]))[::-1]
    t = np.arange(3000) * dt
    behind = (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow)
    assert found[:, 0] == pytest.approx(dipole * (1.0 - behind), abs=0.02 * dipole)
    assert np.abs(found[:, 1:]).max() < 1e-12 and math.isclose(slow, -1.07 / t_const, rel_tol=0.01)


# lanes


@pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")
def test_members_in_lanes_fly_as_each_does_alone():
    rates = {"direction": "uniform", "magnitude": {"uniform": [0.0, 1.0]}}
    peak = {"signal": "attitude_error_deg", "what": {"mean_after_s": 0.0}}
    campaign = Campaign.model_validate({
        "runs": 17, "seed": 3, "outcomes": {"error_deg": peak},
        "vary": {"initial.attitude": "uniform", "initial.rate_deg_s": rates},
    })  # fmt: skip
    scenario = EXAMPLE.replace("simulation.revolutions", 0.5)
    together = fly_campaign(scenario, campaign, workers=1).error_deg.values
    for member in (0, 5, 15):
        alone = torquer.simulate(member_scenario(scenario, campaign, member))
        error = find_attitude_error(alone).angle_deg
        assert together[member] == pytest.approx(float(np.mean(error)), rel=1e-13)


@pytest.mark.parametrize("hold", [LAWS["hold"], STIFF], ids=["three_axis", "matrices"])
def test_of_sixteen_starts_all_are_held_with_it_and_none_without(hold):
    """What `examples/trim_residual_dipole.py` does with more starts and dipoles."""
    vary = {f"initial.euler_deg[{axis}]": {"uniform": [-45.0, 45.0]} for axis in range(3)}
    error = {"signal": "attitude_error_deg", "what": {"mean_after_s": 7.0 * PERIOD_S}}
    campaign = {"runs": 16, "seed": 1, "vary": vary, "outcomes": {"error_deg": error}}
    found = {}
    for name, laws in {
        "with": {"hold": hold, "trim": LAWS["trim"]},
        "none": {"hold": hold},
    }.items():
        scenario = EXAMPLE.replace("control.laws", laws).replace("simulation.revolutions", 8)
        found[name] = fly_campaign(scenario, Campaign.model_validate(campaign)).error_deg.values
    assert found["with"].max() < 5.0
    assert found["none"].min() > 10.0


@pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")
@pytest.mark.slow
def test_in_lanes_it_has_the_same_bits():
    short = EXAMPLE.replace("simulation.revolutions", 0.05)
    for beside, kept, _, _ in fly_both(short, rows=(0, 7, 20)):
        assert np.array_equal(beside, kept)


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.slow
@needs_compiler
def test_c_has_the_same_bits(tmp_path):
    short = EXAMPLE.replace("simulation.revolutions", 0.3)
    steps = int(short.length_s / short.control.cycle_s) - 1
    torquer.export_c(short, tmp_path, steps=steps)
    done = replayed(built(tmp_path, "-O2"), tmp_path)
    said = f"{steps} control steps: the same bits in commands and state\n"
    assert (done.stdout, done.returncode) == (said, 0)
    alone, flown_by_c = torquer.simulate(short), torquer.simulate(short, computer=tmp_path)
    assert np.abs(estimates(alone)).max() > 1e-4  # it has begun to learn
    for name in ("q_body_to_inertial", "command_body", "trim.residual_dipole_a_m2"):
        assert np.array_equal(alone[name], flown_by_c[name])
