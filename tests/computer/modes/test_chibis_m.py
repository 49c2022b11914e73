"""The automatic logic of Chibis-M as shipped presets. Source: SDOT 3.4, Fig. 3.21, Tables 3.3, 3.4.

B-dot until the rate is low and the Sun is seen; TRIAD and wheels until the attitude is within 60
deg; then Kalman filters: Sun sensors in the light, the gyro in their place where they see no Sun;
TRIAD again where accuracy is lost, B-dot where there is no valid attitude or the rate is high.
"""

import math

import numpy as np
import pytest
from flown_modes import Flown, reading
from scipy.linalg import expm

from torquer.computer.modes.check import findings
from torquer.computer.modes.spec import Modes
from torquer.flight.software.modules.svr import MAX, MIN, NORM, SvrSettings, classify_value
from torquer.scenario.load import presets

SHIPPED = presets("region")
MODES = Modes.model_validate({
    "attitude": {"reference": "inertial"},
    "regions": {
        "determination": SHIPPED["chibis_m_determination"],
        "stabilisation": SHIPPED["chibis_m_stabilisation"],
    },
})  # fmt: skip
ESTIMATORS = {name: k for k, name in enumerate(("field_rate", "triad", "mag_dss", "mag_wrate"))}
SUN, DARK = (0.6, 0.0, 0.8), (0.0, 0.0, 0.0)


class Logic(Flown):
    """The table, run second by second."""

    def __init__(self):
        self.modes, self.t_s = MODES, 0.0
        self.names = [name for r in MODES.regions.values() for name in r.states]
        laws = {name: k for k, name in enumerate(("damping", "hold", "unload"))}
        self.table, self.state = MODES.pack(laws, ESTIMATORS)

    def fly(self, seconds, sun=SUN, rate_deg_s=0.05, error_deg=1.0, sigma_deg=0.1, age_s=0.0):
        """States of both regions after so many seconds of the same."""
        half = math.radians(0.5 * error_deg)
        for _ in range(seconds):
            seen = reading(
                self.t_s, sun=sun,
                q_body_to_inertial=(math.sin(half), 0.0, 0.0, math.cos(half)),
                omega_body_rad_s=(0.0, math.radians(rate_deg_s), 0.0),
                sigma_rad=math.radians(sigma_deg),
            )  # fmt: skip
            self(seen._replace(estimate=seen.estimate._replace(t_s=self.t_s - age_s)))
            self.t_s += 1.0
        return self.now


@pytest.fixture
def logic():
    return Logic()


@pytest.fixture
def pointing(logic):
    """In science, in the light."""
    logic.fly(302, rate_deg_s=0.2)
    logic.fly(11, rate_deg_s=0.2)
    logic.fly(12, error_deg=40.0)
    assert logic.fly(70) == ["kalman_mag_dss", "science"]
    return logic


def test_nothing_is_doubtful():
    assert [f.message for f in findings(MODES) if f.is_fault] == []


def test_detumbling_lasts_while_rate_is_high_and_a_while_longer(logic):
    assert logic.fly(4000, rate_deg_s=2.0) == ["bdot", "detumbling"]
    assert logic.fly(295, rate_deg_s=0.39) == ["bdot", "detumbling"]
    assert logic.fly(2, rate_deg_s=0.41) == ["bdot", "detumbling"]  # the time begins again
    assert logic.fly(295, rate_deg_s=0.39) == ["bdot", "detumbling"]
    assert logic.fly(10, rate_deg_s=0.39)[0] == "waiting"


def test_damping_continues_in_shadow_until_the_sun_is_seen(logic):
    assert logic.fly(3000, sun=DARK, rate_deg_s=0.2) == ["waiting", "detumbling"]
    assert logic.fly(12, rate_deg_s=0.2)[0] == "triad"
    assert logic.fly(2, rate_deg_s=0.2, error_deg=100.0) == ["triad", "acquisition"]


def test_triad_leads_to_the_filter_from_60_deg_on(logic):
    logic.fly(320, rate_deg_s=0.2, error_deg=100.0)
    assert logic.fly(500, rate_deg_s=0.2, error_deg=61.0) == ["triad", "acquisition"]
    assert logic.fly(9, rate_deg_s=0.2, error_deg=59.0)[0] == "triad"
    assert logic.fly(3, rate_deg_s=0.2, error_deg=59.0)[0] == "kalman_mag_dss"


@pytest.mark.parametrize(("error_deg", "rate_deg_s"), [(2.35, 0.05), (1.0, 0.085), (2.2, 0.075)])
def test_science_begins_at_small_angles_and_rates(logic, error_deg, rate_deg_s):
    """|q| below 0.02 and rate below 0.08 deg/s, for a minute."""
    logic.fly(330, rate_deg_s=0.2, error_deg=40.0)
    found = logic.fly(70, rate_deg_s=rate_deg_s, error_deg=error_deg)[1]
    small = math.sin(math.radians(0.5 * error_deg)) < 0.02 and rate_deg_s < 0.08
    assert found == ("science" if small else "acquisition")


@pytest.mark.parametrize(("error_deg", "rate_deg_s"), [(17.1, 0.05), (17.3, 0.05), (1.0, 0.41)])
def test_science_ends_at_large_ones(pointing, error_deg, rate_deg_s):
    """|q| above 0.15 or rate above 0.4 deg/s."""
    found = pointing.fly(1, rate_deg_s=rate_deg_s, error_deg=error_deg)
    large = math.sin(math.radians(0.5 * error_deg)) > 0.15 or rate_deg_s > 0.4
    assert found == ["kalman_mag_dss", "acquisition" if large else "science"]


def test_the_vector_part_has_no_scalar():
    """SDOT 3.3 prints sqrt(q0^2 + q1^2 + q2^2); q0 is the scalar of its (1.7).

    By the printed matrix of (1.7) from no turn, about axis 3: q0 begins at 1 and stays near it, so
    that by the printed sum even no turn would be of class MAX.
    """
    one_two_three = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1], [0, 0, -1, 0]])
    settings = SvrSettings()
    for turn_deg, kind in ((1.0, MIN), (10.0, NORM), (20.0, MAX)):
        angle = math.radians(turn_deg)
        q = expm(0.5 * angle * one_two_three) @ [0.0, 0.0, 0.0, 1.0]
        vector = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)
        assert q[3] == pytest.approx(math.cos(0.5 * angle))
        assert vector == pytest.approx(math.sin(0.5 * angle))
        assert classify_value(vector, settings.q_min, settings.q_max) == kind
        printed = math.sqrt(q[3] ** 2 + q[0] ** 2 + q[1] ** 2)
        assert classify_value(printed, settings.q_min, settings.q_max) == MAX


def test_gyro_replaces_an_unseen_sun(pointing):
    assert pointing.fly(4, sun=DARK)[0] == "kalman_mag_dss"
    assert pointing.fly(3, sun=DARK) == ["kalman_mag_wrate", "science"]
    assert pointing.fly(2000, sun=DARK) == ["kalman_mag_wrate", "science"]
    assert pointing.fly(7) == ["kalman_mag_dss", "science"]


@pytest.mark.parametrize("sun", [SUN, DARK])
def test_lost_accuracy_leads_back_to_triad(pointing, sun):
    pointing.fly(10, sun=sun)
    assert pointing.fly(1, sun=sun, sigma_deg=9.9)[0] != "triad"
    assert pointing.fly(1, sun=sun, sigma_deg=10.1)[0] == "triad"


@pytest.mark.parametrize("sun", [SUN, DARK])
def test_an_attitude_of_more_than_10_s_ago_is_none(pointing, sun):
    pointing.fly(10, sun=sun)
    assert pointing.fly(5, sun=sun, age_s=9.9)[1] == "science"
    assert pointing.fly(1, sun=sun, age_s=10.5)[0] == "waiting"
    assert pointing.fly(1, sun=DARK)[1] == "detumbling"


@pytest.mark.parametrize("sun", [SUN, DARK])
def test_a_rate_that_stays_high_leads_back_to_bdot(pointing, sun):
    pointing.fly(10, sun=sun)
    assert pointing.fly(29, sun=sun, rate_deg_s=1.0)[0] != "bdot"
    assert pointing.fly(3, sun=sun, rate_deg_s=1.0) == ["bdot", "detumbling"]


def test_an_unknown_attitude_ends_nothing_that_needs_none(logic):
    unknown = {"q_body_to_inertial": (np.nan,) * 4, "sigma_rad": np.nan}
    for _ in range(400):
        logic(reading(logic.t_s, omega_body_rad_s=(0.0, 0.01, 0.0), **unknown))
        logic.t_s += 1.0
    assert logic.now == ["bdot", "detumbling"]
