"""Wheels in whole runs: momentum, an independent simulation, friction, limits, control."""

import itertools
import math

import numpy as np
import pytest
from integrators import by
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from torquer import law, simulate
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

J = np.array([[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]])
FOUR = {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7}
#: Of 1.6e-3 kg m^2.
WHEELS = {"layout": FOUR, "momentum_limit_n_m_s": 1.0, "torque_limit_n_m": 0.02}
SPEEDS = (1500.0, -800.0, 300.0, 60.0)
FRICTION = {
    "coulomb_friction_n_m": 5e-4,
    "viscous_friction_n_m_s": 2e-5,
    "stiction_n_m": 1e-3,
    "initial_speed_rpm": SPEEDS,
}
HOLD = {
    "kind": "wheel_pd",
    "bandwidth_rad_s": 0.2,
    "reference": "inertial",
    "inertia_kg_m2": J.tolist(),
}
AT_REST = {"initial.rate_deg_s": [0, 0, 0], "initial.euler_deg": [0, 0, 0]}


@law(parameters={"size": 4e-3, "rate": 0.11}, answers="torque")
def swinging(inputs, parameters, memory):
    """A torque that swings about all axes."""
    size, angle = parameters.size, parameters.rate * inputs.t_s
    return (size * np.sin(angle), size * np.cos(1.3 * angle), size * np.sin(0.7 * angle + 1.0))


@pytest.fixture(scope="session")
def craft(make):
    """`craft({"coulomb_friction_n_m": 1e-4}, {"seed": 1})`: the plain satellite on wheels alone."""

    def scenario(wheels=(), changes=()):
        base = {
            "spacecraft.coils": None,
            "spacecraft.wheels": WHEELS | dict(wheels),
            "control": {"law": {"kind": "off"}, "sample_s": 2.0},
            "environment.gravity_gradient": False,
            "simulation": {"duration_s": 120.0, "step_s": 0.5, "record_s": 2.0},
        }
        return make(base | dict(changes))

    return scenario


def axes_of(result):
    from torquer.simulation.results.dataset import flown_scenario

    return np.array(flown_scenario(result).spacecraft.wheels.array().axes)


def drift_of_momentum(result):
    """Greatest change of the whole momentum in the inertial frame, as a part of the wheels'."""
    momentum = result.momentum_inertial.values
    return np.abs(momentum - momentum[0]).max() / np.abs(result.wheel_momentum.values).max()


FAILURES = ({"wheel": 1, "time_s": 31.0, "noticed_after_s": 20.0},)
EVERYTHING = FRICTION | {"failures": FAILURES, "speed_noise_rpm": 1.0}


@pytest.mark.parametrize("keys", [{"initial_speed_rpm": SPEEDS}, EVERYTHING])
def test_body_and_wheels_keep_their_momentum_to_rounding(craft, keys):
    scenario = craft(keys, by("auto") | {"simulation.tolerance_deg": 1e-9})
    result = simulate(scenario, swinging)
    assert np.ptp(result.wheel_momentum.values, axis=0).min() > 0.01
    if keys is EVERYTHING:  # one ends at a stand, one is turned round
        speeds = result.wheel_speed.values
        assert np.any(np.abs(speeds[-10:]) < 1e-3)
        assert np.any(speeds[1:] * speeds[:-1] < 0.0)
    assert drift_of_momentum(result) < 2e-14


def test_rk4_keeps_the_momentum_to_its_order(craft):
    """Also through stands, failures and friction: what a rotor gains, the body loses."""
    for keys in ({"initial_speed_rpm": SPEEDS}, EVERYTHING):
        drifts = [
            drift_of_momentum(simulate(craft(keys, {"simulation.step_s": h}), swinging))
            for h in (1.0, 0.5, 0.25, 0.125)
        ]
        orders = np.log2(np.array(drifts[:-1]) / drifts[1:])
        assert orders == pytest.approx(4.0, abs=0.2)


class Reference:
    """Body and wheels in the speeds W relative to the body; every motor torque u held.

    I (W' + g.w') = u - friction for a wheel that turns, W' = 0 for one that stands, and
    J w' + sum g I W' + w x (J w + sum g I W) = M.
    """

    def __init__(self, result, friction, gravity):
        self.axes, self.inertia = axes_of(result), 1.0 / (6000.0 * 2.0 * math.pi / 60.0)
        self.coulomb = friction.get("coulomb_friction_n_m", 0.0)
        self.viscous = friction.get("viscous_friction_n_m_s", 0.0)
        self.breakaway = friction.get("stiction_n_m", 0.0)
        self.r, self.v = result.position_inertial.values[0], result.velocity_inertial.values[0]
        self.n, self.gravity = np.linalg.norm(self.v) / np.linalg.norm(self.r), gravity

    def place(self, t):
        """Position on the circular orbit."""
        return self.r * math.cos(self.n * t) + self.v / self.n * math.sin(self.n * t)

    def torque(self, t, q):
        if not self.gravity:
            return np.zeros(3)
        r = Rotation.from_quat(q).inv().apply(self.place(t))
        return 3.0 * MU_EARTH_M3_S2 / np.linalg.norm(r) ** 5 * np.cross(r, J @ r)

    def rates(self, t, y, motor, side):
        q, w, speed = np.split(y, (4, 7))
        turning = side != 0.0
        gained = np.where(turning, motor - self.coulomb * side - self.viscous * speed, 0.0)
        loose = self.axes[turning].T @ self.axes[turning] * self.inertia
        held = J @ w + self.inertia * self.axes.T @ speed
        w_rate = np.linalg.solve(
            J - loose, self.torque(t, q) - np.cross(w, held) - self.axes.T @ gained
        )
        speed_rate = np.where(turning, gained / self.inertia - self.axes @ w_rate, 0.0)
        q_rate = 0.5 * np.array([*(q[3] * w + np.cross(q[:3], w)), -q[:3] @ w])
        return np.concatenate([q_rate, w_rate, speed_rate])

    def side(self, speed, motor):
        """+-1: the way a wheel turns or begins to turn; 0: it stands."""
        starts = np.where(np.abs(motor) > self.breakaway, np.sign(motor), 0.0)
        starts = np.where((self.breakaway == 0.0) & (starts == 0.0), 1.0, starts)
        return np.where(speed == 0.0, starts, np.sign(speed))

    def hold(self, t, until, y, motor):
        """On to a time under held motor torques, from stand to stand."""
        while t < until:
            side = self.side(y[7:], motor)
            watched = np.flatnonzero((side != 0.0) & (self.coulomb > 0.0))
            events = [lambda _, y, k=k: y[7 + k] for k in watched]
            for event, k in zip(events, watched, strict=True):
                event.terminal, event.direction = True, -side[k]
            found = solve_ivp(
                lambda t, y: self.rates(t, y, motor, side),  # noqa: B023
                (t, until), y, method="DOP853", rtol=1e-12, atol=1e-14, events=events,
            )  # fmt: skip
            t, y = found.t[-1], found.y[:, -1]
            for times, k in zip(found.t_events, watched, strict=True):
                if len(times):
                    y[7 + k] = 0.0
        return y

    def fly(self, result):
        """State (q, w, W) at the recorded instants, under the motor torques that are recorded."""
        t, y = result.time.values, [np.concatenate(
            [result[name].values[0] for name in ("q_body_to_inertial", "omega_body", "wheel_speed")]
        )]  # fmt: skip
        for i in range(len(t) - 1):
            y.append(self.hold(t[i], t[i + 1], y[-1], result.wheel_torque.values[i]))
        return np.array(y)


def difference(result, friction=(), gravity=False):
    """Greatest differences of (quaternion, rate, wheel speed [rad/s]) from the reference."""
    expected = Reference(result, dict(friction), gravity).fly(result)
    names = ("q_body_to_inertial", "omega_body", "wheel_speed")
    flown = np.hstack([result[name].values for name in names])
    return [float(np.abs(part).max()) for part in np.split(flown - expected, (4, 7), axis=1)]


MINUTE = {"duration_s": 60.0, "record_s": 2.0}


@pytest.mark.parametrize("gravity", [False, True])
def test_without_friction_the_motion_is_that_of_an_independent_simulation(craft, gravity):
    changes = {"simulation": MINUTE | {"tolerance_deg": 1e-10}}
    changes["environment.gravity_gradient"] = gravity
    result = simulate(craft({"initial_speed_rpm": SPEEDS}, changes), swinging)
    assert difference(result, gravity=gravity) == pytest.approx([0.0] * 3, abs=1e-12)
    other = difference(result, gravity=not gravity)
    assert max(other) > 1e-7  # which would be seen


def test_rk4_goes_to_the_same_motion(craft):
    changes = {"simulation": MINUTE | {"step_s": 0.125}}
    result = simulate(craft({"initial_speed_rpm": SPEEDS}, changes), swinging)
    assert difference(result) == pytest.approx([0.0] * 3, abs=1e-7)


VISCOUS = {"viscous_friction_n_m_s": 2e-5, "initial_speed_rpm": SPEEDS}
DRY = {"coulomb_friction_n_m": 5e-4, "stiction_n_m": 5e-4, "initial_speed_rpm": SPEEDS}


@pytest.mark.parametrize("friction", [VISCOUS, DRY, FRICTION], ids=["viscous", "dry", "all"])
def test_with_friction_the_motion_is_that_of_an_independent_simulation(craft, friction):
    """Through stands, to the first order of the step: the bearings feel the rate at its start."""
    coarse, fine = (
        difference(
            simulate(craft(friction, {"simulation": MINUTE | {"step_s": h}}), swinging),
            friction,
        )
        for h in (1.0, 0.125)
    )
    quaternion, rate, speed = coarse
    assert quaternion < 1e-4
    assert rate < 3e-5  # of 0.05 rad/s
    assert speed < 2e-3  # of 150 rad/s
    assert np.all(np.array(fine) < np.array(coarse) / 5.0)


@pytest.mark.parametrize(
    "friction", [{"initial_speed_rpm": SPEEDS}, VISCOUS, DRY, FRICTION],
    ids=["none", "viscous", "dry", "all"],
)  # fmt: skip
def test_adaptive_steps_follow_the_friction_through_stands(craft, friction):
    steps = {"duration_s": 60.0, "record_s": 2.0, "tolerance_deg": 1e-6}
    result = simulate(craft(friction, {"simulation": steps}), swinging)
    quaternion, rate, speed = difference(result, friction)
    assert quaternion < 1e-9
    assert rate < 1e-10  # of 0.05 rad/s
    assert speed < 1e-7  # of 150 rad/s


def test_dead_frictionless_wheel_keeps_its_momentum_about_its_axis(craft):
    keys = {"initial_speed_rpm": SPEEDS, "lost": (2,)}
    result = simulate(craft(keys), swinging)
    carried = result.omega_body.values @ axes_of(result)[2] / (200.0 * math.pi)
    whole = result.wheel_momentum.values[:, 2] + carried
    assert np.ptp(carried) > 1e-5
    assert np.ptp(whole) < 1e-15
    assert not result.wheel_torque.values[:, 2].any()


def test_idle_wheels_run_down_and_leave_momentum_to_body(craft):
    """No law: each stands after (I/v) ln(1 + v w0/c), in a body too heavy to be turned by it."""
    # least squares: minimax would even the momenta out within the null space
    friction = FRICTION | {"stiction_n_m": None, "allocation": "least_squares"}
    heavy = {"spacecraft.body": {"inertia_kg_m2": (1e6 * J).tolist()}, **AT_REST}
    changes = {"simulation": {"duration_s": 300.0, "step_s": 0.5, "record_s": 0.5}, **heavy}
    result = simulate(craft(friction, changes))
    inertia, speeds = 1.0 / (200.0 * math.pi), np.abs(SPEEDS) * math.pi / 30.0
    expected = inertia / 2e-5 * np.log1p(2e-5 * speeds / 5e-4)
    moving = np.abs(result.wheel_speed.values) > 1e-5
    assert result.time.values[moving.sum(axis=0)] == pytest.approx(expected, abs=0.5)
    momentum = 1e6 * J @ result.omega_body.values[-1]
    assert momentum == pytest.approx(result.wheel_momentum.values[0] @ axes_of(result), rel=1e-3)


def test_wheels_of_no_weight_are_as_none(craft, make):
    light = {"momentum_limit_n_m_s": 1e-11, "initial_speed_rpm": SPEEDS}
    changes = {"environment.gravity_gradient": True}
    flown = simulate(craft(light, changes))
    bare = {"spacecraft.coils": None, "simulation": {"duration_s": 120.0, "step_s": 0.5,
                                                     "record_s": 2.0}}  # fmt: skip
    none = simulate(make(bare))
    assert "wheel_speed" not in none
    for name in ("q_body_to_inertial", "omega_body"):
        assert flown[name].values == pytest.approx(none[name].values, abs=1e-10)


def turn_deg(result):
    """Turn vector [deg] of the body from the inertial frame, where it is to be held."""
    return np.degrees(Rotation.from_quat(result.q_body_to_inertial.values).as_rotvec())


def held(craft, keys=(), changes=(), **law):
    """A flight in which the wheels hold the attitude from the start on."""
    base = {
        "control": {"law": HOLD | law, "sample_s": 1.0},
        "simulation": {"duration_s": 600.0, "step_s": 0.5, "record_s": 4.0},
    }
    return simulate(craft(keys, AT_REST | base | dict(changes)))


THREE = {"layout": {"kind": "orthogonal"}, "initial_speed_rpm": (20.0, 3.0, 20.0)}
SLOW = {
    "environment.gravity_gradient": True,
    "simulation": {"duration_s": 1500.0, "step_s": 1.0, "record_s": 10.0},
}


def test_friction_is_met_by_the_spring_of_the_law(craft):
    """At a turn of J^-1 sum g c sign(W)/kappa^2: there the motors make up for it."""
    keys = THREE | {"initial_speed_rpm": (300.0, -400.0, 500.0), "coulomb_friction_n_m": 1e-4}
    turn = turn_deg(held(craft, keys))[-1]
    expected = np.degrees(np.linalg.solve(J, np.array([1e-4, -1e-4, 1e-4]) / 0.2**2))
    assert turn == pytest.approx(expected, rel=1e-3)


def test_a_wheel_that_passes_zero_speed_disturbs_the_attitude(craft):
    """Gravity turns wheel 1 round: its friction changes sides, after a stand if it sticks."""
    frictions = ({}, {"coulomb_friction_n_m": 1e-5},
                 {"coulomb_friction_n_m": 1e-5, "stiction_n_m": 3e-5})  # fmt: skip
    flights = [held(craft, THREE | f, SLOW, bandwidth_rad_s=0.05) for f in frictions]
    worst = []
    for flight in flights:
        speed = flight.wheel_speed.values[:, 1]
        assert speed[0] > 0.0 > speed[-1]
        t = flight.time.values
        worst.append(np.abs(turn_deg(flight)[(t > 600.0) & (t < 1200.0), 1]).max())
    side = np.degrees(np.linalg.solve(J, [1e-5, -1e-5, 1e-5])[1] / 0.05**2)
    assert worst[0] < 0.15 * abs(side)
    assert abs(side) < worst[1] < 1.2 * abs(side)
    assert worst[2] > 1.5 * worst[1]
    stands = [np.sum(np.abs(f.wheel_speed.values[:, 1]) < 1e-4) for f in flights]
    assert stands[0] <= 1
    assert stands[1] >= 5  # of 10 s each


def test_an_idle_share_keeps_wheels_turning_and_the_attitude_held(craft):
    """Standing wheels do not answer small torques; turning ones of opposite ways brake evenly."""
    friction = FRICTION | {"initial_speed_rpm": 0.0}
    changes = {"environment.gravity_gradient": True}
    without = held(craft, friction, changes)
    biased = held(craft, friction | {"minimum_speed_fraction": 0.05}, changes)
    momentum = np.abs(biased.wheel_momentum.values)
    assert momentum[25:].min() > 0.05
    assert np.abs(without.wheel_momentum.values).max() < 0.01
    late = [np.abs(turn_deg(flight)[40:]).max() for flight in (without, biased)]
    assert late[1] < 0.02 * late[0]


def test_limits_of_torque_and_speed_at_every_recorded_instant(craft):
    """A demand beyond all limits: the motors go to theirs, the wheels to theirs, and stay."""
    changes = {"control": {"law": {"kind": "off"}, "sample_s": 0.5}}
    changes |= {"simulation": {"duration_s": 120.0, "record_s": 0.5, "tolerance_deg": 1e-9}}
    for keys in ({}, {"allocation": "least_squares"}, {"speed_noise_rpm": 20.0}):
        wheels = {"initial_speed_rpm": SPEEDS, "momentum_limit_n_m_s": (0.4, 0.5, 0.6, 0.3)}
        wheels |= keys
        result = simulate(craft(wheels, changes), swinging.with_parameters(size=0.05, rate=0.03))
        torque, speed = np.abs(result.wheel_torque.values), np.abs(result.wheel_speed.values)
        assert torque.max() == pytest.approx(0.02, rel=1e-9)
        assert torque.max() <= 0.02 * (1.0 + 1e-12)
        # a body that turns otherwise than at the step's start turns a wheel at its limit on
        assert speed.max() == pytest.approx(200.0 * math.pi, rel=1e-4)
        assert drift_of_momentum(result) < 1e-11


def test_failures_in_flight(craft):
    """A wheel that is asked in vain leaves the body to its friction; the others take over."""

    def flight(*failures):
        friction = {**FRICTION, "failures": failures}
        flown = held(craft, friction)
        return flown.time.values, np.linalg.norm(turn_deg(flown), axis=1), flown

    t, whole, _ = flight()
    dead = {"wheel": 0, "time_s": 101.0}
    _, at_once, _ = flight(dead)
    _, later, flown = flight({**dead, "noticed_after_s": 40.0})
    _, never, _ = flight({**dead, "noticed_after_s": 1e5})
    before, noticed = t <= 100.0, t > 101.0 + 40.0 + 60.0
    for turn in (at_once, later, never):
        assert np.array_equal(turn[before], whole[before])
    assert at_once.max() < 1.05 * whole[t < 500.0].max()
    until = t <= 140.0
    assert np.array_equal(later[until], never[until])
    assert later.max() > 5.0 * at_once.max()
    assert later[noticed] == pytest.approx(at_once[noticed], abs=0.02 * at_once.max())
    assert never[noticed].min() > 5.0 * at_once.max()
    asked = flown.wheel_torque.values[:, 0]
    assert np.all(asked[(t > 101.0) & (t <= 140.0)] != 0.0)
    assert not asked[t > 141.0].any()


def test_coils_unload_the_wheels_while_the_attitude_is_held(craft):
    """h' = -k (h - b (b.h)) with b along the field, which turns along the orbit."""
    keys, k = {"initial_speed_rpm": (900.0, 300.0, -200.0, 0.0)}, 5e-4
    unload = {"laws": {"coils": {"kind": "unloading", "gain_per_s": k}, "wheels": HOLD}}
    changes = {
        "spacecraft.coils": {"limit_a_m2": 20.0},
        "control": unload | {"sample_s": 1.0},
        "simulation": {"revolutions": 2.0, "step_s": 1.0, "record_s": 20.0},
    }
    result = held(craft, keys, changes)
    h = result.wheel_momentum.values @ axes_of(result)
    size = np.linalg.norm(h, axis=1)
    b = result.b_inertial.values
    b /= np.linalg.norm(b, axis=1)[:, None]
    expected = [h[0]]
    for now, after in itertools.pairwise(b):
        middle = (now + after) / np.linalg.norm(now + after)
        y = expected[-1]
        half = y - 10.0 * k * (y - now * (now @ y))
        expected.append(y - 20.0 * k * (half - middle * (middle @ half)))
    assert h == pytest.approx(np.array(expected), abs=3e-3 * size[0])
    assert size[-1] < 0.05 * size[0]
    assert np.abs(turn_deg(result)).max() < 0.1
    assert np.abs(result.command_body.values).max() < 20.0


def test_wheel_at_its_limit_is_held_when_body_drives_on(craft):
    """Motors off, no friction: the body is braked about the axis of the wheel that is full."""
    keys = {"initial_speed_rpm": (6000.0, 0.0, 0.0, 0.0), "speed_limit_rpm": 6000.0}
    steps = {"duration_s": 60.0, "record_s": 2.0}
    sphere = {"spacecraft.body": {"inertia_kg_m2": [1.5] * 3}, **AT_REST}
    axis = np.array(craft(keys, {"simulation": steps}).spacecraft.wheels.array().axes[0])
    for sign, driven in ((1.0, False), (-1.0, True)):
        torque = {"constant_torque_n_m": (sign * 1e-4 * axis).tolist()}
        changes = {"simulation": steps, "disturbance": torque, "control.law": {"kind": "off"}}
        result = simulate(craft(keys, changes | sphere))
        speeds = result.wheel_speed.values[:, 0] / (200.0 * math.pi)
        assert result.attrs["how_it_ended"] == "complete"
        assert float(result.steps) < 1000
        if driven:
            assert speeds == pytest.approx(np.ones(len(speeds)), abs=1e-8)
        else:
            assert speeds[-1] < 1.0 - 1e-6
        turned = result.momentum_inertial.values[-1] - result.momentum_inertial.values[0]
        assert np.linalg.norm(turned) == pytest.approx(60.0 * 1e-4, rel=1e-2)


def test_wheel_driven_to_its_limit_by_the_body_stops_there(craft):
    """The limit is reached in the middle of a long step."""
    keys = {"initial_speed_rpm": (5999.98, 0.0, 0.0, 0.0), "speed_limit_rpm": 6000.0}
    steps = {"duration_s": 60.0, "record_s": 20.0}
    sphere = {"spacecraft.body": {"inertia_kg_m2": [1.5] * 3}, **AT_REST}
    axis = np.array(craft(keys, {"simulation": steps}).spacecraft.wheels.array().axes[0])
    torque = {"constant_torque_n_m": (-1e-4 * axis).tolist()}
    changes = {"simulation": steps, "disturbance": torque, "control.law": {"kind": "off"}}
    speeds = simulate(craft(keys, changes | sphere)).wheel_speed.values[:, 0] / (200.0 * math.pi)
    assert speeds[0] < 1.0 - 3e-6
    assert speeds[-1] == pytest.approx(1.0, abs=1e-8)


def test_wheels_without_friction_at_rest_need_no_short_steps(craft):
    """Rates of rounding carry the rotors through zero speed all the time."""
    steps = {"duration_s": 600.0, "record_s": 10.0}
    result = simulate(craft({}, {"simulation": steps, **AT_REST}))
    assert float(result.least_step) >= 0.1
