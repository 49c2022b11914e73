"""B-dot in a field that turns, release by release."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from torquer.spacecraft.actuators.coils import Coils
from torquer.theory.slow.detumbling import Tumbling
from torquer.theory.slow.gains import Sampling
from torquer.theory.slow.turning_field import releases_stop_s

FIELD_T, GAIN, INERTIA = 3e-5, 1e4, 0.05
#: Below the limits of the coils, and braked as by the ideal law.
CASE = Tumbling(INERTIA, np.array([FIELD_T]), Coils(limit_a_m2=1e3), Sampling(0.0, 1e-3))
#: Time [s] in which rotation across the field decays e-fold.
DECAY_S = INERTIA / (GAIN * FIELD_T**2)


def stop(fields, case=CASE, moments=(INERTIA,) * 3, from_rad_s=0.1, releases=2000, **keys):
    return releases_stop_s(
        case, GAIN, fields, 20.0, moments, from_rad_s, 0.02, releases=releases, **keys
    )


def steady(steps: int = 6000):
    return np.tile([0.0, 0.0, FIELD_T], (steps, 1))


def test_rotation_about_a_field_at_rest_stays():
    """Across it the rate decays exponentially; along it, it stays."""
    times = stop(steady())
    assert np.isinf(times).mean() == pytest.approx(1.0 - 0.02 / 0.1, abs=0.03)
    cosines = 0.2 * (np.arange(2000) + 0.5) / 2000
    across = 0.1 * np.sqrt(1.0 - cosines**2), np.sqrt(0.02**2 - (0.1 * cosines) ** 2)
    wanted = np.sort(DECAY_S * np.log(across[0] / across[1]))
    found = np.sort(times[np.isfinite(times)])
    for part in (0.1, 0.5, 0.9):
        assert np.quantile(found, part) == pytest.approx(np.quantile(wanted, part), rel=0.05)


@pytest.mark.parametrize("turned", [0.2, 0.4])
def test_the_last_stops_as_fast_as_the_field_turns(turned):
    """In its frame, u along it and v across, u' = W v, v' = -v/T - W u: the last of all starts
    stops as the norm of that system's exponential falls; `turned`: W T."""
    angle = turned * 100.0 / DECAY_S * np.arange(8000)
    fields = FIELD_T * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    times = releases_stop_s(CASE, GAIN, fields, 100.0, (INERTIA,) * 3, 0.1, 0.02, releases=500)
    system = np.array([[0.0, turned], [-turned, -1.0]]) / DECAY_S
    at = np.arange(100.0, 4e5, 100.0)
    norms = np.array([np.linalg.norm(expm(system * t), 2) for t in at])
    assert times.max() == pytest.approx(at[norms > 0.02 / 0.1][-1], rel=0.05)


def test_a_long_body_keeps_the_momentum_of_its_rotation():
    """It turns about the greatest moment: from its momentum over that, at its pace."""
    long = (INERTIA, INERTIA, 0.0 * INERTIA + 1e-9)
    times, sphere = stop(steady(), moments=long), stop(steady())
    assert np.isinf(times).mean() == pytest.approx(
        np.mean([max(0.0, 1.0 - 0.2 / math.sin(math.acos(c))) for c in np.linspace(0, 0.999, 500)]),
        abs=0.03,
    )
    assert np.isinf(times).mean() < np.isinf(sphere).mean()


def test_saturated_coils_brake_by_their_limit():
    """A relay's mean dipole hardly depends on the rate: time goes with rate over limit."""
    weak = CASE._replace(coils=Coils(limit_a_m2=0.02))
    angle = 0.02 * 20.0 * np.arange(60_000)
    fields = FIELD_T * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)
    one, two = (
        np.median(releases_stop_s(weak, 1e6, fields, 20.0, (INERTIA,) * 3, rate, 0.05, releases=64))
        for rate in (0.15, 0.25)
    )
    assert two / one == pytest.approx((0.25 - 0.05) / (0.15 - 0.05), rel=0.1)


@pytest.mark.parametrize(
    ("fields", "rates", "says"),
    [
        (steady(), (0.1, 0.2), "below_rad_s: must be positive and below from_rad_s; received 0.2"),
        (steady(), (0.1, 0.0), "below_rad_s: must be positive and below from_rad_s; received 0"),
        (steady(3), (0.1, 0.02), r"b_inertial_t: must be 4 or more rows of 3; received shape \(3"),
        (
            np.zeros(9),
            (0.1, 0.02),
            r"b_inertial_t: must be 4 or more rows of 3; received shape \(9",
        ),
    ],
)
def test_refusals(fields, rates, says):
    with pytest.raises(ValueError, match=f"^{says}"):
        releases_stop_s(CASE, GAIN, fields, 20.0, (INERTIA,) * 3, *rates)
