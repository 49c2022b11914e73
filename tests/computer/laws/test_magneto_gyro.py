"""The magneto-gyroscopic law: its flown kernels against the exact linear models; relay coils."""

import math
from itertools import product

import numpy as np
import pytest
from law_cases import compiled, inputs

from torquer.base.conventions import EARTH_RATE_RAD_S, FIELD_RADIUS_M
from torquer.computer.laws.magneto_gyro.kernel import MEMORY
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.magneto_gyro.relay import EACH_COIL, NEAREST_ANGLE, relay_dipole
from torquer.computer.laws.magneto_gyro.stage_1 import filtered_component
from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_1 import STAGE_1, stage_1_driven_by
from torquer.theory.magneto_gyro.stage_2 import driven_by, stage_2_loop

RATE, STRENGTH, NORMAL = 1.03e-3, 3.3e-5, -0.13
CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, RATE)
UNIT = CRAFT.torque_unit
R, V = (4e6, -2e6, 6e6), (5e3, 5e3, -1.6e3)
#: A call this much later: the continuous model to a few 1e-6.
STEP_S = 1e-5
TAUS = (0.3, 1.7, 4.4)


def cells(**values):
    """Memory of the law, by name."""
    flat = {name: np.atleast_1d(values.get(name, first)) for name, first in MEMORY.items()}
    return np.concatenate([np.asarray(x, float).ravel() for x in flat.values()])


def part(memory, name):
    """A part of the memory."""
    before = list(MEMORY)[: list(MEMORY).index(name)]
    first = sum(np.size(MEMORY[key]) for key in before)
    return memory[first : first + np.size(MEMORY[name])]


def spec(gains, **keys):
    return MagnetoGyro(
        inertia_kg_m2=CRAFT.inertia_kg_m2, bias_momentum_n_m_s=CRAFT.wheel_n_m_s,
        orbital_rate_rad_s=RATE, capture_angle_gain=6.0, capture_rate_gain=4.0,
        filter_rate_rad_s=0.02, angle_gains=gains[:3], rate_gains=gains[3:6],
        estimator_gains=gains[6:12], compensator_gains=gains[12:], **keys,
    )  # fmt: skip


def orbital_axes():
    up, normal = np.array(R), np.cross(R, V)
    up, normal = up / np.linalg.norm(up), normal / np.linalg.norm(normal)
    return np.array([np.cross(normal, up), normal, up]).T


def of_text(b, meridian_deg=40.0):
    """Keys of the text's form for which the dipole's field at R is b [T], at the second call."""
    size = (FIELD_RADIUS_M / np.linalg.norm(R)) ** 3
    x, y, z = 1e9 * (orbital_axes() @ (np.array([-1.0, -1.0, 0.5]) * b)) / size
    earth_fixed = complex(x, y) * np.exp(-1j * math.radians(meridian_deg))
    return {"form": "text", "dipole_nt": [z, earth_fixed.real, earth_fixed.imag],
            "meridian_deg": meridian_deg - math.degrees(EARTH_RATE_RAD_S * STEP_S)}  # fmt: skip


def field(tau):
    return STRENGTH * np.array([2 / 3 * math.cos(tau), NORMAL, -4 / 3 * math.sin(tau)])


def called(law, b, reading, coils, memory):
    """(Dipole, memory afterwards) of a call STEP_S after the last; all vectors in t, w, s."""
    model = orbital_axes() @ b
    row = inputs(STEP_S, reading, r=R, v=V, model_b=model, coils=coils)
    after = memory.copy()
    return np.array(compiled(law)(row, law.pack(), after).dipole_a_m2), after


def always(**more):
    return {"has_call": 1.0, "shortest_call_s": STEP_S, **more}


@pytest.mark.parametrize("form", ["field", "text"])
@pytest.mark.parametrize("tau", TAUS)
def test_flown_stage_2_is_the_controller_of_the_exact_model(form, tau):
    gains = Stage2Gains(*np.random.default_rng(7).uniform(-3.0, 3.0, 15))
    b = field(tau)
    law = spec(gains, **(of_text(b) if form == "text" else {})).law()
    loop = stage_2_loop(CRAFT.satellite(), CRAFT.gyrostat, gains, normal=NORMAL, form=form)

    def answer(x, error):
        angles, seen, rates, found = x[:3], x[6:9], x[9:12], x[12:15]
        reading = b - np.cross(angles, b) + STRENGTH * error
        memory = cells(**always(
            stage=2.0, angles_rad=seen, rates_rad_s=RATE * rates,
            residual_dipole_a_m2=-UNIT / STRENGTH * found,
        ))  # fmt: skip
        dipole, _ = called(law, b, reading, (0.0, 0.0, 0.0), memory)
        _, after = called(law, b, reading, dipole, memory)
        changes = (part(after, name) - part(memory, name) for name in
                   ("angles_rad", "rates_rad_s", "residual_dipole_a_m2"))  # fmt: skip
        units = np.repeat([1.0, RATE, -UNIT / STRENGTH], 3)
        torque = np.cross(dipole, b) / UNIT / [loop.parameters[k] for k in "xyz"]
        return np.concatenate([torque, np.concatenate(list(changes)) / units / (RATE * STEP_S)])

    for k in range(18):
        x, error = np.split(1e-3 * np.eye(18)[k], [15])
        found = (answer(x, error) - answer(-x, -error)) / 2e-3
        want = loop.matrix(tau)[:, k] if k < 15 else driven_by(loop, tau)[:, k - 12]
        if 6 <= k < 15:
            assert found[:3] == pytest.approx(want[3:6], abs=1e-4)
        assert found[3:] == pytest.approx(want[6:], rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("tau", TAUS)
def test_flown_stage_1_is_the_controller_of_the_exact_model(tau):
    law = spec([1.0] * 15, filter_damping=0.6).law()
    frequency = 0.02 / RATE
    loop = STAGE_1.with_parameters(
        **CRAFT.satellite()._asdict(), normal=NORMAL, frequency=frequency, damping=0.6
    )
    b = field(tau)
    pole = frequency**2 / (frequency**2 - 1.0 + 1.2j * frequency)
    turning = np.array([2 / 3 * np.exp(1j * tau), 0.0, 4 / 3 * 1j * np.exp(1j * tau)])
    low = STRENGTH * (pole * turning).real + [0.0, STRENGTH * NORMAL, 0.0]
    slope = RATE * STRENGTH * (1j * pole * turning).real

    def answer(x, error):
        angles, low_off, rate_off = x[:3], x[6:9], x[9:12]
        reading = b - np.cross(angles, b) + STRENGTH * error
        memory = cells(**always(
            stage=1.0, model_low_t=low, model_rate_t_s=slope,
            reading_low_t=low + STRENGTH * low_off,
            reading_rate_t_s=slope + RATE * STRENGTH * rate_off,
        ))  # fmt: skip
        dipole, after = called(law, b, reading, (0.0, 0.0, 0.0), memory)
        change = [part(after, f"reading_{n}") - part(memory, f"reading_{n}")
                  for n in ("low_t", "rate_t_s")]  # fmt: skip
        change = np.concatenate(change) / np.repeat([STRENGTH, RATE * STRENGTH], 3)
        torque = np.cross(dipole, b) / UNIT / [loop.parameters[k] for k in "xyz"]
        return np.concatenate([torque, change / (RATE * STEP_S)])

    gravity_and_wheel = STAGE_1.with_parameters(
        **{**loop.parameters, "angle_gain": 0.0, "rate_gain": 0.0}
    ).matrix(tau)
    for k in (0, 1, 2, *range(6, 15)):
        x, error = np.split(1e-4 * np.eye(15)[k], [12])
        found = (answer(x, error) - answer(-x, -error)) / 2e-4
        want = loop.matrix(tau)[:, k] if k < 12 else stage_1_driven_by(loop, tau)[:, k - 9]
        free = gravity_and_wheel[3:6, k] if k < 12 else np.zeros(3)
        assert found[:3] == pytest.approx(want[3:6] - free, rel=1e-5, abs=1e-3)
        assert found[3:] == pytest.approx(want[6:], rel=1e-5, abs=1e-3)


def test_the_filter_is_the_published_link():
    """q' = q1 + w^2 B, q1' = -w^2 q - 2 z w (q1 + w^2 B): the rate of the low pass is q."""
    w, z, h, value = 0.3, 0.4, 1e-3, 2.0
    low, rate, q, q1 = 1.0, 0.5, 0.5, -(w**2) * 1.0 - 2.0 * z * w * 0.5
    matrix = np.array([[0.0, 1.0], [-(w**2), -2.0 * z * w]])
    push = np.array([w**2 * value, -2.0 * z * w**3 * value])
    for _ in range(5000):
        low, rate = filtered_component(low, rate, value, w, z, h)
        y = np.array([q, q1])
        k1 = matrix @ y + push
        k2 = matrix @ (y + 0.5 * h * k1) + push
        k3 = matrix @ (y + 0.5 * h * k2) + push
        k4 = matrix @ (y + h * k3) + push
        q, q1 = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    assert rate == pytest.approx(q, rel=1e-9)
    assert -(w**2) * low - 2.0 * z * w * rate == pytest.approx(q1, rel=1e-9)


def test_a_relay_combination_has_the_least_angle_of_all_26():
    rng = np.random.default_rng(5)
    every = np.array([c for c in product((-1.0, 0.0, 1.0), repeat=3) if any(c)])
    cosines = every / np.linalg.norm(every, axis=1)[:, None]
    for _ in range(500):
        wanted = rng.normal(size=3) * rng.choice([0.05, 1.0], size=3)
        found = relay_dipole(tuple(wanted), NEAREST_ANGLE, 1e-3, 7.0)
        assert np.array_equal(found, 7.0 * every[np.argmax(cosines @ wanted)])


def test_relay_coils_are_off_below_their_thresholds():
    wanted = (3.0, -0.4, 0.6)
    assert relay_dipole(wanted, EACH_COIL, 0.5, 10.0) == (10.0, 0.0, 10.0)
    assert relay_dipole(wanted, NEAREST_ANGLE, 3.2, 10.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"coils": "each_coil"}, "relay_threshold_a_m2: must be given with coils = 'each_coil'; "
                                 "received None"),
        ({"relay_dipole_a_m2": 5.0}, "relay_dipole_a_m2: must be left out with coils = 'linear'; "
                                     "received 5.0"),
        ({"form": "text"}, "dipole_nt: must be given with form = 'text'; received None"),
        ({"meridian_deg": 3.0}, "meridian_deg: must be left out with form = 'field'; received 3"),
        ({"stage_1_angle_deg": 10.0}, "stage_1_angle_deg: must be above stage_2_angle_deg, or the "
                                      "stages would chatter; received 10 and 15"),
        ({"stage_1_angle_deg": 15.0}, "received 15 and 15"),
    ],
)  # fmt: skip
def test_mistakes_are_said_in_one_line(keys, message):
    with pytest.raises(ValueError) as caught:
        spec([1.0] * 15, **keys)
    assert message in str(caught.value)
