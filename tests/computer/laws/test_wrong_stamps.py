"""One stamp that is off by part of an interval: laws that measure intervals let go of it."""

import functools
import math

import numpy as np
import pytest
from computer.laws.test_bias_momentum import asked, remembering
from computer.laws.test_laws import EXAMPLES, SPECS
from hypothesis import given, settings, strategies as st
from law_cases import inputs

from torquer.computer.laws import bdot, sdot
from torquer.computer.laws.magneto_gyro.kernel import _interval

#: Good readings after which a law must be back: those that a stamp off by one bit takes.
BACK = 18
MODELS = {"model_b": (2e-5, 0.0, 1e-5), "model_sun": (1.0, 0.0, 0.0)}
#: Parts of an interval by which a stamp is off.
OFF = [-1.0 + 1e-12, -0.99, -0.7, -0.3, 0.3, 0.7, 0.99, 1.0 - 1e-9, 1.0 - 1e-13]


def stamps(step_s, off, count=60, at=(20,)):
    """Stamps at a step, of which some are off by a part of it."""
    times = step_s * np.arange(count)
    times[list(at)] += off * step_s
    return np.maximum.accumulate(times)


def turning(t):
    return (3e-5 * math.cos(0.1 * t), 3e-5 * math.sin(0.1 * t), 1e-5)


def by_field(times, good):
    memory = cells(bdot.Bdot(gain_a_m2_s_per_t=1.0))
    rows = [inputs(t, turning(s)) for t, s in zip(times, good, strict=True)]
    return np.array([bdot.bdot_difference(row, bdot.Gain(1e5), memory) for row in rows])


def by_sun(times, good):
    memory = cells(sdot.Sdot(gain_a_m2_s=1.0))
    rows = [
        inputs(t, sun=tuple(np.array(turning(s)) / math.hypot(3e-5, 1e-5)), **MODELS)
        for t, s in zip(times, good, strict=True)
    ]
    return np.array([sdot.sdot_difference(row, sdot.Gain(1e3), memory) for row in rows])


def by_wheel(times, good):
    """Dipole of the momentum-biased law, and what its integral has gained at each call."""
    law, memory = remembering(integral_time_s=200.0)
    found = []
    for t, s in zip(times, good, strict=True):
        before = memory.pitch_integral_rad_s
        dipole = asked(law, memory, t, t, 1e-9 * s).dipole_a_m2
        found.append([*dipole, memory.pitch_integral_rad_s - before])
    return np.array(found)


def by_gyrostat(times, good):
    """Intervals that the magneto-gyroscopic system takes; zeros are gaps."""
    memory = cells(SPECS.validate_python({"kind": "magneto_gyro", **EXAMPLES["magneto_gyro"]}))
    return np.array([_interval(float(t), 1.1e-3, memory) for t in times])


def cells(spec):
    law = spec.law()
    return law.record_of(law.first_memory())


@functools.cache
def undisturbed(flown, step_s, count=60):
    """What comes of good stamps: found once for all that is compared with it."""
    good = stamps(step_s, 0.0, count)
    return flown(good, good)


@pytest.mark.parametrize("step_s", [0.25, 3.0, 100.0])
@pytest.mark.parametrize("off", OFF)
@pytest.mark.parametrize("flown", [by_field, by_gyrostat, by_sun, by_wheel])
@pytest.mark.parametrize("at", [(20,), (20, 21, 23, 24)], ids=["one", "several"])
def test_a_law_is_back_after_stamps_that_were_off(flown, off, step_s, at):
    good = stamps(step_s, 0.0)
    spoiled, sound = flown(stamps(step_s, off, at=at), good), undisturbed(flown, step_s)
    after = slice(at[-1] + BACK, None)
    assert np.all(np.any(sound[after].reshape(len(sound[after]), -1) != 0.0, axis=1))
    assert spoiled[after] == pytest.approx(sound[after], rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 0.999), min_size=1, max_size=20))
def test_whatever_the_stamps_were(parts):
    """Twenty stamps in order at any places in the time that they stand for."""
    good = stamps(1.0, 0.0, 80)
    times = good.copy()
    times[20 : 20 + len(parts)] = 20.0 + len(parts) * np.sort(parts)
    after = slice(20 + len(parts) + BACK, None)
    for flown in (by_field, by_sun):
        sound = undisturbed(flown, 1.0, 80)
        assert flown(times, good)[after] == pytest.approx(sound[after], rel=1e-9)


@pytest.mark.parametrize("gaps", [1, 2])
def test_a_long_gap_is_one_even_after_another(gaps):
    """Two rests in a row, each of an hour: no difference is taken across them."""
    good = np.array([0.0, 1.0, 2.0, *(3600.0 * (k + 1) for k in range(gaps))])
    assert np.all(by_field(good, good)[3:] == 0.0)
    assert np.all(by_sun(good, good)[3:] == 0.0)
