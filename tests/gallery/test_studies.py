"""Studies of others: members flown by an independent code, and stored results flown again."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gallery.studies import pocketqube, pocketqube_page
from gallery.studies.__main__ import page as made_page
from gallery.studies.flying import read
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
HOUR_S, SAMPLE_S = 3600.0, 0.25


class Plain:
    """A member in plain NumPy: rigid body, field, law, without a line of the simulator's motion."""

    def __init__(self, scenario, length_s):
        craft, law = scenario.spacecraft, scenario.control.law
        self.inertia = np.diag(craft.body.inertia_kg_m2)
        self.residual, self.bias = craft.coils.residual_dipole_a_m2, craft.magnetometer.bias_nt
        self.residual, self.bias = np.array(self.residual), 1e-9 * np.array(self.bias)
        self.gain, self.full = law.parameters["gain_a_m2_t_s"], law.parameters["full_a_m2"]
        self.weighted = law.parameters["weighted"]
        self.before, self.turning, self.dipole = None, np.full(3, 0.25), np.zeros(3)
        t_s = np.arange(0.0, length_s + SAMPLE_S, 0.5 * SAMPLE_S)
        self.samples = round(length_s / SAMPLE_S)
        around = scenario.orbit_environment()
        self.field = around.field(t_s, *around.state(t_s))
        self.start = np.array([*scenario.initial.quaternion,
                               *np.radians(scenario.initial.rate_deg_s)])  # fmt: skip

    def in_body(self, state, b):
        x, y, z, w = state[:4] / np.linalg.norm(state[:4])
        to_inertial = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        return to_inertial.T @ b

    def command(self, b):
        """The published law on a new sample [T]."""
        b = b + self.bias
        unit, size = b / np.linalg.norm(b), np.linalg.norm(b)
        rate = np.zeros(3) if self.before is None else (unit - self.before) / SAMPLE_S
        if self.before is not None:
            self.turning += (0.5 * SAMPLE_S * np.abs(rate) - self.turning) / 200.0
        self.before = unit
        weight = 16.0 * np.linalg.norm(self.turning) + 1.0 - math.sqrt(3.0) * 16.0 * 0.065 / 8.0
        wanted = -self.gain / (weight if self.weighted else 1.0) * rate / size
        on_s = 0.6 * SAMPLE_S * np.minimum(1.0, np.abs(wanted) / self.full)
        self.dipole = np.sign(wanted) * (on_s - 0.01) * self.full / SAMPLE_S

    def derivative(self, state, b_inertial):
        x, y, z, w, p, q, r = state.tolist()
        (bx, by, bz), (mx, my, mz) = self.in_body(state, b_inertial), self.dipole + self.residual
        jx, jy, jz = self.inertia
        return [
            0.5 * (w * p + y * r - z * q), 0.5 * (w * q + z * p - x * r),
            0.5 * (w * r + x * q - y * p), -0.5 * (x * p + y * q + z * r),
            (my * bz - mz * by - (jz - jy) * q * r) / jx,
            (mz * bx - mx * bz - (jx - jz) * r * p) / jy,
            (mx * by - my * bx - (jy - jx) * p * q) / jz,
        ]  # fmt: skip

    def flown(self):
        """State at the end."""
        state = self.start
        for k in range(self.samples):
            self.command(self.in_body(state, self.field[2 * k]))
            state = self.over_a_sample(state, k)
            state[:4] /= np.linalg.norm(state[:4])
        return state

    def over_a_sample(self, state, k):
        """By DOP853 of SciPy to 1e-13; the field by a parabola through three points."""
        a, m, e = self.field[2 * k : 2 * k + 3]

        def at(t, y):
            s = t / SAMPLE_S
            b = a * (1 - s) * (1 - 2 * s) + 4 * m * s * (1 - s) + e * s * (2 * s - 1)
            return self.derivative(y, b)

        found = solve_ivp(at, (0.0, SAMPLE_S), state, "DOP853", rtol=1e-13, atol=1e-15)
        return found.y[:, -1]


def by_the_simulator(law, length_s):
    """A member without noise, flown for some time [s]: the scenario, and the state at the end."""
    scenario = with_values(
        pocketqube.members("converged", law, 4)[3],
        {
            "spacecraft.magnetometer.noise_nt": 0.0,
            "spacecraft.magnetometer.resolution_nt": 0.0,
            "simulation.revolutions": None,
            "simulation.duration_s": length_s,
            "simulation.integrator": "auto",
            "simulation.step_s": None,
            "simulation.tolerance_deg": 1e-9,
        },
    )
    last = simulate(scenario).isel(time=-1)
    return scenario, np.r_[last["q_body_to_inertial"].values, last["omega_body"].values]


def apart(one, other) -> tuple[float, float]:
    """Angle [rad] between two attitudes, and the difference of rates over the rate."""
    angle = 2.0 * math.acos(min(1.0, abs(float(one[:4] @ other[:4]))))
    return angle, float(np.linalg.norm(one[4:] - other[4:]) / np.linalg.norm(one[4:]))


@pytest.mark.parametrize(("law", "length_s", "most"), [
    ("plain", 60.0, 1e-9), ("weighted", 60.0, 1e-9),
    pytest.param("plain", HOUR_S, 1e-6, marks=pytest.mark.slow),
])  # fmt: skip
def test_a_member_by_an_independent_code(law, length_s, most):
    scenario, end = by_the_simulator(law, length_s)
    angle, rate = apart(end, Plain(scenario, length_s).flown())
    assert rate < most and angle < max(most, 1e-7)  # an arc cosine of 1 has half the digits


@pytest.mark.slow
@pytest.mark.parametrize(("case", "law"), [("as published", "plain"), ("as published", "weighted"),
                                           ("converged", "plain")])  # fmt: skip
def test_a_stored_member_flies_again(case, law):
    stored = read(pocketqube.NAME)["cases"][case]["rows"][0][law]
    found = pocketqube.flown(pocketqube.members(case, law, 1)[0])
    assert found.keys() == stored.keys()
    for key, value in stored.items():
        assert found[key] == (None if value is None else pytest.approx(value, rel=1e-3)), key


def test_what_the_page_says_is_what_was_flown():
    """Its paragraph states these in words."""
    for law in pocketqube.LAWS:
        stopped = {
            case: np.isfinite(pocketqube_page.columns(case, law)["stopped_h"])
            for case in read(pocketqube.NAME)["cases"]
            if case != "free"
        }
        assert stopped["as published"].all() and not stopped["converged"].any()
        assert stopped["10 Hz"].all()
        late = pocketqube_page.columns("10 Hz", law)["stopped_h"].mean()
        assert 1.6 < late / pocketqube_page.columns("as published", law)["stopped_h"].mean() < 2.4
        fastest = pocketqube_page.columns("converged", law)["greatest_deg_s"]
        assert (fastest > 1.5 * math.sqrt(3.0) * 180.0).all()
    for case in ("as published", "10 Hz"):
        saved, error = pocketqube_page.change(case, "on_h")
        assert saved < -2.0 * error


def test_the_page_is_the_one_of_the_results():
    page = Path(__file__).parents[2] / "docs" / "studies.md"
    assert page.read_text(encoding="utf-8") == made_page()


def test_steps_damp_by_themselves():
    free = read(pocketqube.NAME)["cases"]["free"]["rows"][0]
    assert pocketqube.damped_part(1.0, "rk4") == pytest.approx(free["rk4"], rel=1e-6)
    assert 0.2 < free["rk4"] < 0.26 and abs(free["splitting"]) < 1e-9


def test_draws_follow_the_published_distributions():
    table = pocketqube.table(200)
    coils = np.array(table["spacecraft.coils.limit_a_m2"])
    assert np.array_equal(coils, table["control.law.parameters.full_a_m2"])
    assert coils.std() == pytest.approx(0.002 / 15.0, rel=0.1) and coils.mean() == pytest.approx(
        0.002, rel=0.02
    )
    inertia = np.array(table["spacecraft.body.inertia_kg_m2"])
    assert all(map(pocketqube.is_body, inertia.tolist()))
    gain = np.array(table["control.law.parameters.gain_a_m2_t_s"])
    assert np.corrcoef(gain, inertia.sum(axis=1))[0, 1] > 0.9  # both of the mass
    nominal = load_scenario(pocketqube.SCENARIO)
    assert pocketqube.gain_a_m2_t_s(nominal.orbit, 0.0002642766798576922) == pytest.approx(
        1.2073916906534135e-06, rel=1e-8
    )
