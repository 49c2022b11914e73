"""Calibration by a known attitude, corrections judged by the vector, dipoles in a loop."""

import numpy as np
import pytest
from telemetry_session import BIAS, MATRIX, START, TLE, environment, motion, session

from torquer import simulate
from torquer.base.limits import RequestError
from torquer.compile import engine
from torquer.environment.orbit import Sgp4
from torquer.ground.telemetry.calibration import GROUPS, MODELS
from torquer.ground.telemetry.diagnosis.loop import follow
from torquer.ground.telemetry.examine import examine
from torquer.ground.telemetry.modulus import FieldAlong
from torquer.ground.telemetry.reading.quantities import make_session
from torquer.ground.telemetry.reading.read import Session
from torquer.ground.telemetry.vector import MODEL, calibrate_vector, known_field
from torquer.scenario.load import scenario_from_data

ORBIT = Sgp4(tle=TLE)
UNIT = np.eye(3)
#: Soft iron and a sensor turned by 2 deg: what no |B| sees.
SOFT = np.array([[1.02, 0.03, -0.01], [-0.04, 0.97, 0.02], [0.01, -0.02, 1.01]])


def with_attitude(seed, turn=UNIT, noise=50e-9, rows=200):
    """A session with quaternions, stamps without a shift."""
    t_s, env = 31.0 * np.arange(rows), environment()
    to_body, omega = motion(t_s, seed)
    b = to_body.apply(env.field(t_s, *env.state(t_s)))
    rng = np.random.default_rng(seed)
    m = b @ np.linalg.inv(turn).T + BIAS + noise * rng.normal(size=b.shape)
    q = to_body.inv().as_quat()
    utc = np.datetime64(START.replace(tzinfo=None), "ns") + (1e9 * t_s).astype("timedelta64[ns]")
    values = {"b_measured": m, "omega_measured": omega, "q_measured": q}
    return make_session(utc, values, source="synthetic"), b


def along(data):
    """The field along the orbit at the rows of a session."""
    return FieldAlong(environment(), data["time"].values)


def test_rows_without_an_attitude_are_calibrated_by_the_others():
    """Telemetry has quaternions now and then: every row keeps its residual and its flag."""
    data, b = with_attitude(7, SOFT)
    data["q_measured"].values[::3] = np.nan
    data["b_measured"].values[4] = np.nan
    found = examine(Session(data, ()), ORBIT, MODEL)
    assert len(found.calibration.residual) == len(found.calibration.weight) == 199
    flags = found.calibrated["Flags_F"].values
    assert flags[4] == 255 and (np.delete(flags, 4) == 0).all()
    off = np.linalg.norm(found.calibration.apply(data) - b, axis=1)
    assert np.nanmax(off) < 400e-9


def test_twelve_parameters_are_found_within_their_stated_errors():
    off = []
    for seed in range(12):
        data, b = with_attitude(seed, SOFT)
        found = calibrate_vector(data, along(data), known_field(data, environment()))
        assert found.groups == MODEL and found.rms == pytest.approx(50e-9, rel=0.2)
        sigmas = np.array(list(found.sigmas.values()))
        true = np.concatenate([BIAS, (SOFT - np.eye(3)).ravel()])
        off.append((found.values - true) / sigmas)
        assert np.abs(found.apply(data) - b).max() < 400e-9
    assert 0.6 < np.mean(np.square(off)) < 1.6 and np.abs(off).max() < 4.5


def test_the_sensor_turned_in_the_body_is_seen_by_the_attitude_alone():
    data, b = with_attitude(3, SOFT)
    session_ = Session(data, ())
    size = examine(session_, ORBIT, ("bias", "scale", "non_orthogonality"))
    whole = examine(session_, ORBIT, MODEL)
    errors = [
        np.sqrt(np.mean(np.sum((each.calibration.apply(data) - b) ** 2, axis=1)))
        for each in (size, whole)
    ]
    assert errors[1] < 0.2 * errors[0] and errors[1] < 110e-9
    assert "with bias, matrix" in whole.verdict


def test_wrong_rows_have_no_weight():
    data, _ = with_attitude(4, SOFT)
    data["b_measured"].values[[5, 50, 111]] += 1e-5
    data["q_measured"].values[[20, 70]] = data["q_measured"].values[[90, 10]]
    found = calibrate_vector(data, along(data), known_field(data, environment()))
    assert np.flatnonzero(found.weight == 0.0).tolist() == [5, 20, 50, 70, 111]
    assert found.bias == pytest.approx(BIAS, abs=40e-9)


def test_the_attitude_is_needed_for_its_model():
    data, _ = session(3)
    with pytest.raises(RequestError, match="model: must have q_measured that agrees"):
        examine(Session(data, ()), ORBIT, MODEL)
    swapped, _ = with_attitude(3)
    swapped["q_measured"].values[:] = swapped["q_measured"].values[:, [3, 0, 1, 2]]
    with pytest.raises(RequestError, match="model: must have q_measured that agrees"):
        examine(Session(swapped, ()), ORBIT, MODEL)


def test_what_a_correction_does_to_the_vector_is_said():
    data, _ = with_attitude(5, MATRIX)
    found = examine(Session(data, ()), ORBIT)
    text = next(each.text for each in found.findings if each.key == "vector")
    assert text.startswith("by the logged attitude the field vector goes from 28")


def test_a_correction_that_makes_the_vector_worse_is_not_used():
    """A turned sensor whose soft iron |B| explains the wrong way round: bias alone is kept."""
    turn = np.array([[1.0, 0.06, 0.0], [-0.06, 1.0, 0.0], [0.0, 0.0, 1.0]])
    data, _ = with_attitude(6, turn)
    asked = examine(Session(data, ()), ORBIT, ("bias",))
    data["q_measured"].values[:] = _spoilt(data, asked)
    found = examine(Session(data, ()), ORBIT)
    keys = [each.key for each in found.findings]
    assert "the vector gets worse" in keys
    assert found.calibration.groups == ("bias",)


def _spoilt(data, found):
    """Attitudes estimated from the readings as they are: the turn that carries the model's field
    into the reading."""
    from scipy.spatial.transform import Rotation

    known = known_field(data, environment())
    read = data["b_measured"].values
    q = Rotation.from_quat(data["q_measured"].values)
    turns = []
    for m, b in zip(read, known.field, strict=True):
        axis = np.cross(b, m)
        sine = np.linalg.norm(axis) / (np.linalg.norm(b) * np.linalg.norm(m))
        turns.append(axis / np.linalg.norm(axis) * np.arcsin(sine))
    return (q * Rotation.from_rotvec(-np.array(turns))).as_quat()


# dipoles


def _commands(kind, m, rng):
    made = np.zeros_like(m)
    if kind == "B-dot":
        made[1:] = -2e6 * np.diff(m, axis=0)
    elif kind == "late B-dot":
        made[2:] = -2e6 * np.diff(m, axis=0)[:-1]
    elif kind == "relay":
        made[1:] = -0.3 * np.sign(np.diff(m, axis=0))
    elif kind == "cross product":
        made = np.cross([1e4, 2e4, -3e4], m)
    else:
        made = np.repeat(rng.uniform(-0.3, 0.3, (len(m) // 20 + 1, 3)), 20, axis=0)[: len(m)]
    return made


@pytest.mark.parametrize("kind", ["B-dot", "late B-dot", "relay", "cross product", "steps"])
@pytest.mark.parametrize("every", [1, 4, 10])
def test_dipoles_made_from_the_readings_are_recognised(kind, every):
    for seed in range(4):
        data, _ = session(seed, rows=3000, cadence_s=1.0)
        m = data["b_measured"].values
        dipole = _commands(kind, m, np.random.default_rng(seed))
        found = follow(*(each[20::every] for each in (data["time"].values, m, dipole)))
        assert found.is_loop == (kind != "steps")


@pytest.mark.parametrize("strength_nt", [500.0, 40_000.0])
def test_readings_that_feel_the_coils_are_no_loop(strength_nt):
    """Coils that step as they were told; 40 uT for each A m^2 is a magnetometer beside a coil."""
    data, _ = session(8, rows=1500, cadence_s=4.0)
    dipole = _commands("steps", data["b_measured"].values, np.random.default_rng(8))
    coupling = 1e-9 * strength_nt * np.array([[1.0, 0.2, 0.0], [0.1, -0.8, 0.3], [0.0, 0.2, 1.2]])
    data["b_measured"].values[:] += dipole @ coupling.T
    data = data.assign(dipole_body=(data["b_measured"].dims, dipole))
    found = examine(Session(data, ()), ORBIT, MODELS[4])
    names, sigmas = GROUPS["coils"].names, found.calibration.sigmas
    off = np.array([found.calibration.of(name) for name in names]) - coupling.ravel()
    assert np.abs(off / [sigmas[name] for name in names]).max() < 4.0
    assert max(sigmas[name] for name in names) < 30e-9


def test_few_rows_and_constant_dipoles_say_nothing():
    t_s, m = np.arange(100.0), np.random.default_rng(0).normal(size=(100, 3))
    assert follow(t_s, m, np.full((100, 3), 0.1)) is None
    assert follow(t_s[:39], m[:39], m[:39]) is None


SCENARIO = {
    "start": START.isoformat(),
    "orbit": {"kind": "sgp4", "tle": list(TLE)},
    "spacecraft": {
        "body": {"inertia_kg_m2": [1.5, 1.3, 1.7]},
        "coils": {"limit_a_m2": 3.0},
        "magnetometer": {"noise_nt": 50.0, "bias_nt": [1500.0, -900.0, 2200.0]},
    },
    "initial": {"rate_deg_s": [0.5, -0.4, 0.3]},
    "control": {"sample_s": 1.0, "law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e6}},
    "simulation": {"duration_s": 4000.0, "record_s": 4.0, "record_inputs": True},
}


def flown(seed):
    """A session of a satellite under B-dot as its computer knows it, and the true field."""
    result = simulate(scenario_from_data(SCENARIO | {"seed": seed})).isel(time=slice(1, None))
    utc = np.datetime64(START.replace(tzinfo=None), "ns")
    utc = utc + (1e9 * result["time"].values).astype("timedelta64[ns]")
    values = {
        "b_measured": result["b_measured"].values,
        "dipole_body": result["coil_dipole_on_board"].values,
    }
    return make_session(utc, values, source="flight"), result["b_body"].values


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_no_correction_of_a_closed_loop_makes_the_vector_worse():
    """20 flights: the correction is never worse than the reading, and knows the bias."""
    for seed in range(20):
        data, b = flown(seed)
        found = examine(Session(data, ()), ORBIT)
        assert "coils" not in found.calibration.groups
        assert any(each.key == "dipoles follow the readings" for each in found.findings)
        before, after = (
            np.sqrt(np.mean(np.sum((each - b) ** 2, axis=1)))
            for each in (data["b_measured"].values, found.calibration.apply(data))
        )
        assert after < 0.1 * before


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_coils_of_a_closed_loop_are_refused():
    data, _ = flown(3)
    with pytest.raises(RequestError, match="model: must not fit the coils, as the dipoles follow"):
        examine(Session(data, ()), ORBIT, ("bias", "scale", "coils"))
