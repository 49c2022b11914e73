"""A start by the field alone: what is stated while it converges; the mixture of hypotheses."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, HANDED_OVER, SCENARIO, without
from law_cases import by_hand, compiled, inputs
from scipy.spatial.transform import Rotation
from scipy.stats import multivariate_normal
from slow_cases import slow_after

from torquer import resume, simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import nees
from torquer.compile import engine
from torquer.computer.estimation import hypotheses
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.interface import UNKNOWN_ESTIMATE
from torquer.scenario.load import scenario_from_data

flown = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ALONE = {
    keys["kind"]: {**without(keys, "sun_noise_deg"), "sensors": ["magnetometer"]}
    for keys in (GYRO, DYNAMICS)
}
WITH_SUN = {keys["kind"]: keys for keys in (GYRO, DYNAMICS)}
SPECS = {"kalman_gyro": KalmanGyro, "kalman_dynamics": KalmanDynamics}
EVERY = pytest.mark.parametrize("kind", ALONE)
#: Of what is flown or compiled: the second kind takes as long again.
ONE = pytest.mark.parametrize("kind", slow_after(1, ALONE))
#: About that of an Earth-pointing satellite, and a slow tumbling.
RATES_DEG_S = (0.06, 0.4)
_FIRST_TURN, _OMEGA = (1.0, -2.0, 0.5), np.array([0.002, -0.001, 0.003])


def scenario(estimator, initial=None, **changes):
    return scenario_from_data(
        {
            **SCENARIO,
            "initial": initial or SCENARIO["initial"],
            "disturbance": DISTURBANCE,
            "control": {"law": {"kind": "off"}, "estimator": estimator},
            "simulation": {"duration_s": 2400.0, "step_s": 1.0, "record_s": 10.0, **changes},
        }
    )


def from_anywhere(estimator, runs):
    """The same flight from attitudes and directions of the rate that are equally likely."""
    rng = np.random.default_rng(28)
    for number, member in enumerate(make_members(scenario(estimator), runs)):
        axis = rng.normal(size=3)
        rate = RATES_DEG_S[number % len(RATES_DEG_S)] * axis / np.linalg.norm(axis)
        q = rng.normal(size=4)
        initial = {"quaternion": list(q / np.linalg.norm(q)), "rate_deg_s": list(rate)}
        yield member.replace("initial", initial)


@pytest.fixture(scope="module", params=slow_after(1, ALONE))
def anywhere(request):
    """Errors and covariances of 40 starts."""
    return fly_filter(from_anywhere(ALONE[request.param], 40))


def total_deg(found):
    """Attitude errors and stated standard deviations (runs, samples), all axes together."""
    error = np.degrees(np.linalg.norm(found.errors[..., :3], axis=2))
    return error, np.degrees(np.sqrt(np.einsum("rkii->rk", found.covariance[..., :3, :3])))


@flown
def test_no_accuracy_is_stated_before_there_is_one(anywhere):
    """A single filter from the first reading on stated less than 5 deg while more than 20 deg off
    in 14 of these starts with the gyro and in 30 without, for 475 s and 630 s (medians)."""
    error, sigma = total_deg(anywhere)
    assert not ((sigma < 5.0) & (error > 20.0)).any()
    assert np.quantile(error[:, 0], 0.9) > 90.0  # nothing is known at first
    assert np.quantile(error[:, -60:], 0.95) < 5.0 and (sigma[:, -1] < 5.0).all()


@flown
def test_errors_are_as_large_as_the_mixture_says(anywhere):
    """Mean square of all errors over what is stated, while it converges; NEES afterwards.

    Of wide, many-peaked distributions the covariance states the mean square, no more.
    """
    error, sigma = total_deg(anywhere)
    early = anywhere.t_s < 300.0
    assert np.mean(error[:, early] ** 2) / np.mean(sigma[:, early] ** 2) == pytest.approx(
        1, abs=0.2
    )
    assert nees(anywhere, 3)[:, anywhere.t_s > 1500.0].mean() / 3.0 == pytest.approx(1.0, abs=0.2)


@flown
@ONE
def test_an_attitude_that_is_taken_over_needs_no_hypotheses(kind):
    """The filter then is the one that it would be with Sun sensors, to the bit."""
    data = scenario(ALONE[kind], duration_s=300.0).model_dump(mode="json", exclude_unset=True)
    data["control"] = {"estimator": ALONE[kind], **HANDED_OVER}
    result = simulate(scenario_from_data(data))
    assert (result["estimator.hypotheses"].values[1:] == 0.0).all()
    true = tuple(Rotation.from_rotvec(_FIRST_TURN).as_quat())
    rows = readings(40)
    rows = [row._replace(estimate=row.estimate._replace(
        t_s=-0.1, q_body_to_inertial=true, omega_body_rad_s=(0.0, 0.0, 0.0),
        sigma_rad=0.1, sigma_rad_s=0.01,
    )) for row in rows]  # fmt: skip
    both = [SPECS[kind](**keys[kind]).estimator() for keys in (ALONE, WITH_SUN)]
    found = [estimates(compiled(each), each, rows)[0] for each in both]
    assert np.isfinite(found[0]).any() and np.array_equal(*found, equal_nan=True)


@flown
@ONE
def test_a_run_resumes_to_the_same_bits_amid_hypotheses(kind):
    one = simulate(scenario(ALONE[kind], duration_s=400.0))
    stopped = simulate(scenario(ALONE[kind], duration_s=400.0), until_s=105.0)
    assert stopped["estimator.hypotheses"].values[-1] > 1.0
    other = resume(stopped)
    for name in ("q_estimated", "attitude_sigma", "estimator.hypotheses"):
        assert np.array_equal(one[name].values, other[name].values, equal_nan=True)


def readings(count):
    """What a computer reads on a tumbling satellite while the field turns, a row a second."""
    rng, rows, omega = np.random.default_rng(3), [], _OMEGA
    for t_s in range(count):
        attitude = Rotation.from_rotvec(_FIRST_TURN) * Rotation.from_rotvec(t_s * omega)
        b = 3e-5 * np.array([math.cos(0.002 * t_s), math.sin(0.002 * t_s), 0.4])
        rate = 6e-8 * np.array([-math.sin(0.002 * t_s), math.cos(0.002 * t_s), 0.0])
        field = attitude.inv().apply(b) + 5e-8 * rng.normal(size=3)
        place = ((7e6, 0.0, 0.0), (0.0, 7e3, 0.0), b, rate, (1.0, 0.0, 0.0))
        zero = (0.0, 0.0, 0.0)
        gyro = omega + 2e-4 * rng.normal(size=3)
        row = inputs(float(t_s), field, zero, gyro, zero, (0, 0, 0, 1), zero, *place, zero)
        rows.append(row._replace(estimate=UNKNOWN_ESTIMATE))
    return rows


def estimates(function, estimator, rows):
    """Numbers of each estimate, and the memory that is left."""
    packed, cells = estimator.pack(), estimator.first_memory()
    found = [function(row, packed, cells) for row in rows]
    return np.array([np.hstack([np.ravel(part) for part in each]) for each in found]), cells


@pytest.mark.slow
@flown
@EVERY
def test_plain_python_gives_the_same(kind):
    estimator, rows = SPECS[kind](**ALONE[kind]).estimator(), readings(25)
    one, memory = estimates(by_hand(estimator), estimator, rows)
    other, kept = estimates(compiled(estimator), estimator, rows)
    assert estimator.record_of(kept)["hypotheses"] > 1.0
    assert other == pytest.approx(one, rel=1e-9, abs=1e-12, nan_ok=True)
    assert kept == pytest.approx(memory, rel=1e-6, abs=1e-12, nan_ok=True)


def begun(kind, count=1, **keys):
    """A filter's inputs, parameters and memory after some readings."""
    estimator, rows = SPECS[kind](**ALONE[kind], **keys).estimator(), readings(count)
    _, cells = estimates(compiled(estimator), estimator, rows)
    return rows[-1], estimator.parameters, estimator.record_of(cells)


@ONE
def test_every_hypothesis_at_the_start_fits_the_reading(kind):
    row, _, memory = begun(kind)
    b = np.array(row.b_body_t)
    live = np.isfinite(memory.log_weight)
    turns = Rotation.from_quat(memory.hypothesis_q[live])
    assert live.sum() == memory.hypotheses == hypotheses._AT_START
    predicted = turns.inv().apply(row.ephemeris.b_inertial_t)
    assert predicted == pytest.approx(np.tile(b, (live.sum(), 1)), abs=4 * 50e-9)
    apart = (turns[0].inv() * turns).as_rotvec() @ (b / np.linalg.norm(b))
    spaced = np.arange(live.sum()) * 2.0 * np.pi / live.sum()
    assert np.cos(apart - spaced) == pytest.approx(1.0, abs=1e-4)
    assert np.exp(memory.log_weight[live]).sum() == pytest.approx(1.0, rel=1e-12, abs=0)


@pytest.mark.parametrize("bias", slow_after(1, [{}, {"magnetometer_bias_sigma_nt": 300.0}]))
def test_weights_follow_the_density_of_the_innovations(bias):
    """Differences between two hypotheses, beside the density by its definition."""
    row, parameters, memory = begun("kalman_gyro", 5, **bias)
    row = readings(6)[-1]._replace(b_body_t=tuple(np.array(row.b_body_t) + 4e-8))
    found, expected = [], []
    for k in (0, 7):
        hypotheses.load(memory, k)
        value = hypotheses.log_likelihood(row, parameters, memory, (0.0, 0.0, 0.0))
        m, _ = hypotheses.latest(row, parameters, memory, 0, (0.0, 0.0, 0.0), 0.0)
        h = np.zeros((m.count, len(memory.correction)))
        h[:, :3] = np.array(m.h)[: m.count]
        for at, other in zip(m.at, m.h_other, strict=True):
            if at:
                h[:, at : at + 3] = np.array(other)
        s = h @ memory.covariance @ h.T + m.r * np.eye(m.count)
        found.append(value)
        expected.append(multivariate_normal.logpdf(m.z[: m.count], cov=s))
    assert found[1] - found[0] == pytest.approx(expected[1] - expected[0], rel=1e-9, abs=1e-9)
    assert abs(found[1] - found[0]) > 1e-3


@pytest.mark.parametrize("wild", [(-3e-5, 2e-5, 5e-5), (math.nan, 0.0, 0.0), (0.0, math.inf, 0.0)])
def test_a_wild_reading_does_not_decide(wild):
    """Beyond the gate only the hypotheses' widths count, not how far off each one is."""
    _, parameters, memory = begun("kalman_gyro", 5)
    row = readings(6)[-1]._replace(b_body_t=wild)
    hypotheses.load(memory, 0)
    value = hypotheses.log_likelihood(row, parameters, memory, (0.0, 0.0, 0.0))
    if np.isfinite(wild).all():
        assert -0.5 * parameters.sensing.gate_2 - 10.0 < value < -0.5 * parameters.sensing.gate_2
    else:
        assert value == 0.0  # no reading


def test_a_gyro_that_reads_no_number_leaves_the_hypotheses():
    """They are propagated by the last rate."""
    estimator, rows = KalmanGyro(**ALONE["kalman_gyro"]).estimator(), readings(12)
    rows[6] = rows[6]._replace(omega_body_rad_s=(0.0, math.nan, 0.0))
    found, cells = estimates(compiled(estimator), estimator, rows)
    assert np.isfinite(found).all()
    memory = estimator.record_of(cells)
    assert memory["starts"] == 1.0 and memory["hypotheses"] > 1.0


@ONE
def test_a_split_changes_neither_mean_nor_covariance(kind):
    """For a narrow hypothesis: what is left is of third order in its width."""
    _, _, memory = begun(kind)
    n = len(memory.correction)
    rng = np.random.default_rng(1)
    root = 1e-3 * rng.normal(size=(n, n)) * np.repeat([1.0, 0.1], [3, n - 3])[:, None]
    memory.covariance[:] = root @ root.T
    covariance, q = memory.covariance.copy(), memory.q.copy()
    memory.states[:] = states = 1e-3 * rng.normal(size=n - 3)
    memory.log_weight[:] = -np.inf
    memory.log_weight[2] = 0.0
    hypotheses.store(memory, 2)
    hypotheses.split(memory, 2, 5)
    narrower = memory.hypothesis_covariance[5]
    assert np.trace(narrower[:3, :3]) < np.trace(covariance[:3, :3])
    assert np.linalg.eigvalsh(narrower).min() > 0.0
    assert not np.allclose(memory.hypothesis_states[2], memory.hypothesis_states[5])
    hypotheses.mix(memory)
    assert memory.q == pytest.approx(q, abs=1e-8)
    assert memory.states == pytest.approx(states, abs=1e-8)
    sigma = np.sqrt(np.diag(covariance))
    assert memory.covariance / np.outer(sigma, sigma) == pytest.approx(
        covariance / np.outer(sigma, sigma), abs=0.02
    )
    assert memory.hypotheses == 0.0  # narrow: it is the filter again


@ONE
@pytest.mark.parametrize("variance", [100.0, math.nan])
def test_filter_that_lost_all_knowledge_starts_as_at_first(kind, variance):
    """A wrong field model made the attitude uncertain by 1e18 deg, at last not a number.

    What the filter stated itself is not taken over from the step before.
    """
    estimator, rows = SPECS[kind](**ALONE[kind]).estimator(), readings(26)
    function = compiled(estimator)
    _, cells = estimates(function, estimator, rows[:24])
    stated = function(rows[24], estimator.pack(), cells)
    memory = estimator.record_of(cells)
    memory.hypotheses = 0.0
    memory.covariance[:] = variance * np.eye(len(memory.correction))
    memory.states[:], memory.unrest, memory.isolated[0] = 1e6, 1e3, 1.0
    own = stated._replace(t_s=rows[24].t_s, sigma_rad=10.0)
    row = rows[25]._replace(estimate=own)
    again = function(row, estimator.pack(), cells)
    assert memory.starts == 2.0 and memory.hypotheses == hypotheses._AT_START
    assert memory.unrest == memory.isolated[0] == 0.0
    first = function(row, estimator.pack(), estimator.first_memory())
    assert again.q_body_to_inertial == pytest.approx(first.q_body_to_inertial, abs=1e-12)
    assert again.sigma_rad == pytest.approx(first.sigma_rad, rel=1e-3)


BY_HAND = """
import math, runpy, sys

tests = runpy.run_path(sys.argv[1])
tests["test_every_hypothesis_at_the_start_fits_the_reading"]("kalman_dynamics")
tests["test_filter_that_lost_all_knowledge_starts_as_at_first"]("kalman_dynamics", math.nan)
"""


def test_the_other_kind_passes_in_plain_python():
    """Every time; compiled and flown it is with the slow tests."""
    done = subprocess.run(
        [sys.executable, "-c", BY_HAND, __file__], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
