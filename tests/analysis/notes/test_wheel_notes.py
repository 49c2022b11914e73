"""Notes on scenarios with reaction wheels: what they say, and that it is true."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.analysis.notes.notes import write_notes

HOLD = {
    "kind": "wheel_pd",
    "bandwidth_rad_s": 0.05,
    "inertia_kg_m2": [1.0, 1.3, 1.7],
    "reference": "inertial",
}
WHEELS = {
    "layout": {"kind": "orthogonal_and_skew"},
    "momentum_limit_n_m_s": 0.5,
    "torque_limit_n_m": 0.05,
}
#: All is well: wheels at rest, a small turn to make.
WELL = {
    "spacecraft.coils": None,
    "spacecraft.body.inertia_kg_m2": [1.0, 1.3, 1.7],
    "spacecraft.wheels": WHEELS,
    "control.law": HOLD,
    "initial": {"euler_deg": [5.0, 0.0, 0.0], "rate_deg_s": [0.1, 0.0, 0.0]},
}


@pytest.fixture
def notes_with(make):
    """Notes of the good scenario with changes."""
    return lambda changes=(): write_notes(make(WELL | dict(changes)))


def test_nothing_is_said_where_all_is_well(notes_with):
    assert notes_with() == []


UNLOADING = {"kind": "unloading", "gain_per_s": 1e-3}
COILS = {"spacecraft.coils": {"limit_a_m2": 1.0}}


def laws(**laws):
    """Laws by name, in place of the only one."""
    return {"control": {"laws": laws}}


def test_wheels_without_a_law(notes_with):
    damping = laws(coils={"kind": "bdot", "gain_a_m2_s_per_t": 1e4})
    (note,) = notes_with(COILS | damping)
    assert note.startswith("no law drives the wheels (control.laws)")
    assert notes_with({"control.law": {"kind": "off"}}) == []
    damping["control"]["laws"]["wheels"] = {"kind": "off"}
    assert notes_with(COILS | damping) == []


def test_a_law_of_the_users_own_may_drive_the_wheels(notes_with):
    own = {"kind": "user", "file": "own.py", "function": "own"}
    assert notes_with({"control.law": own}) == []


def test_unloading_of_nothing(notes_with):
    both = laws(coils=UNLOADING, wheels=HOLD)
    assert notes_with(COILS | both) == []
    without = notes_with(COILS | {"control.law": UNLOADING})
    assert len(without) == 2
    assert without[0].startswith("no wheel law compensates the torque of the coils")


def in_modes(first, second, factor=1.0):
    """The law `first` at the start, `second` after a minute."""
    states = {
        "acquire": {"laws": ["first"], "transitions": [{"to": "hold", "at_most_s": 60.0}]},
        "hold": {"laws": {"second": factor}, "final": True},
    }
    return {"control": {"laws": {"first": first, "second": second}, "modes": {"states": states}}}


def test_laws_of_modes_are_reported_by_name(notes_with):
    """Holding is looked at in every mode, the start only in the initial ones."""
    far = {"initial": {"euler_deg": [60.0, 0.0, 0.0], "rate_deg_s": [0.0] * 3}}
    weak = far | {"spacecraft.wheels": WHEELS | {"torque_limit_n_m": 1e-3}}
    fast = HOLD | {"bandwidth_rad_s": 0.4}
    (note,) = notes_with(far | in_modes(HOLD, fast))
    assert note.startswith("second: the wheel law has a time constant of 2.5 s")
    (note,) = notes_with(weak | in_modes(HOLD, HOLD))
    assert note.startswith("first: at the start the law demands")
    rest = {"kind": "off"}
    assert notes_with(weak | in_modes(rest, HOLD)) == []


def test_the_factor_of_a_mode_counts(notes_with):
    """A factor of 1000 on 2 zeta kappa = 0.1 1/s, and held for 1 s."""
    (note,) = notes_with(in_modes(HOLD, HOLD, 1000.0))
    assert note.startswith("second: the wheel law is unstable with torques held for 1 s")


def test_the_pitch_loop_of_a_momentum_bias_may_be_unstable(notes_with):
    law = {"kind": "bias_momentum", "bias_momentum_n_m_s": 0.1, "pitch_inertia_kg_m2": 1.3,
           "bandwidth_rad_s": 0.05, "nutation_gain_a_m2_s_per_t": 0.0,
           "unloading_gain_per_s": 0.0}  # fmt: skip
    assert notes_with(COILS | {"control.law": law}) == []
    (note,) = notes_with(COILS | {"control.law": law | {"bandwidth_rad_s": 1.1}})
    assert "unstable with torques held for 1 s: its damping of 2.2 1/s must be below 2" in note


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"coulomb_friction_n_m": 0.05}, "Coulomb friction of 0.05 N m is not below the torque"),
        ({"stiction_n_m": 0.06, "coulomb_friction_n_m": 0.01}, "stiction of 0.06 N m is not below"),
        (
            {"viscous_friction_n_m_s": 1e-4},
            "friction at the highest speed, 0.0628 N m, is not below the torque limit of 0.05 N m",
        ),
    ],
)
def test_friction_beyond_the_motors(notes_with, keys, text):
    (note,) = notes_with({"spacecraft.wheels": WHEELS | keys})
    assert text in note
    less = {name: 0.4 * value for name, value in keys.items()}
    assert notes_with({"spacecraft.wheels": WHEELS | less}) == []


def test_idle_share_needs_a_null_space(notes_with):
    assert notes_with({"spacecraft.wheels": WHEELS | {"minimum_speed_fraction": 0.1}}) == []
    three = WHEELS | {"minimum_speed_fraction": 0.1, "layout": {"kind": "orthogonal"}}
    (note,) = notes_with({"spacecraft.wheels": three})
    assert note.startswith(
        "minimum_speed_fraction has no effect: these wheels cannot all spin above 10%"
    )


def fall(damping, stiffness, hold_s) -> float:
    """Greatest root of an axis whose torque is held, by the matrix of one interval."""
    push = np.array([0.5 * hold_s**2, hold_s])
    step = np.array([[1.0, hold_s], [0.0, 1.0]]) - np.outer(push, [stiffness, damping])
    return float(np.abs(np.linalg.eigvals(step)).max())


@settings(max_examples=100, deadline=None)
@given(st.floats(0.01, 3.0), st.floats(0.1, 3.0), st.sampled_from([0.5, 1.0, 4.0]))
def test_unstable_laws_are_reported(make, bandwidth, damping, hold_s):
    law = HOLD | {"bandwidth_rad_s": bandwidth, "damping": damping}
    scenario = make(
        WELL | {"control.law": law, "control.sample_s": hold_s, "simulation.step_s": 0.5}
    )
    root = fall(2.0 * damping * bandwidth, bandwidth**2, hold_s)
    said = any("unstable with torques held for" in note for note in write_notes(scenario))
    if abs(root - 1.0) > 1e-6:
        assert said is (root > 1.0)


def test_lyapunov_laws_may_be_unstable_too(notes_with):
    def law(rate, angle):
        gains = {"rate_gain_n_m_s": rate, "angle_gain_n_m": angle}
        keys = {k: v for k, v in HOLD.items() if k != "bandwidth_rad_s"}
        return {"control.law": keys | gains | {"kind": "wheel_lyapunov"}}

    assert notes_with(law(0.1, 0.005)) == []
    # the lightest axis has 1 kg m^2: d T = 2.1
    (note,) = notes_with(law(2.1, 0.005))
    assert note.startswith("the wheel law is unstable with torques held for 1 s: its damping")
    (note,) = notes_with(law(1.9, 0.005))
    assert note.startswith(
        "the wheel law has a time constant of 1.05 s, and torques are held for 1 s"
    )


def test_coarse_sampling_is_reported(notes_with):
    fast = {"control.law": HOLD | {"bandwidth_rad_s": 0.4}, "initial.euler_deg": [0.1, 0, 0]}
    (note,) = notes_with(fast)
    assert "has a time constant of 2.5 s, and torques are held for 1 s" in note
    assert notes_with(fast | {"control.sample_s": 0.5, "simulation.step_s": 0.5}) == []
    window = {"control.measure_s": 0.5, "control.actuate_s": 1.0}
    assert len(notes_with(fast | window | {"control.sample_s": 0.5, "simulation.step_s": 0.5})) == 1


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
def test_torque_beyond_the_wheels(notes_with, allocation):
    """About z: 2 kappa^2 J sin(a/2) = 0.0085 N m at 60 deg and kappa = 0.1."""
    turn = {"initial": {"euler_deg": [60.0, 0.0, 0.0], "rate_deg_s": [0.0] * 3}}
    law = {"control.law": HOLD | {"bandwidth_rad_s": 0.1}}
    torque = 2.0 * 0.1**2 * 1.7 * 0.5

    def wheels(limit):
        three = {"layout": {"kind": "orthogonal"}, "allocation": allocation}
        return {"spacecraft.wheels": WHEELS | three | {"torque_limit_n_m": limit}}

    assert notes_with(turn | law | wheels(1.001 * torque)) == []
    (note,) = notes_with(turn | law | wheels(0.5 * torque))
    assert "the law demands 0.017 N m, 2 times what the wheels can give" in note


def test_sharing_by_least_squares_gives_less(notes_with):
    """Axes x, y, z and (1, 1, 1): about x the pseudo-inverse asks 5/6 of the torque of wheel x."""
    turn = {"initial": {"euler_deg": [0.0, 0.0, 60.0], "rate_deg_s": [0.0] * 3}}
    law = {"control.law": HOLD | {"bandwidth_rad_s": 0.1}}
    torque = 2.0 * 0.1**2 * 1.0 * 0.5
    for factor, count in ((0.84, 0), (0.82, 1)):
        keys = {"torque_limit_n_m": factor * torque, "allocation": "least_squares"}
        assert len(notes_with(turn | law | {"spacecraft.wheels": WHEELS | keys})) == count
    minimax = {"torque_limit_n_m": 0.82 * torque}
    assert notes_with(turn | law | {"spacecraft.wheels": WHEELS | minimax}) == []


def test_the_wanted_attitude_is_reached_from_any_frame(notes_with):
    """The same attitude named in the orbital frame by both: no spring, whatever the torque."""
    law = HOLD | {"reference": "orbital", "euler_deg": [100.0, 20.0, 0.0]}
    at_rest = {
        "reference": "orbital",
        "rate_relative_to": "orbital",
        "euler_deg": [100.0, 20.0, 0.0],
        "rate_deg_s": [0.0, 0.0, 0.0],
    }
    weak = {"spacecraft.wheels": WHEELS | {"torque_limit_n_m": 1e-6}}
    assert notes_with(weak | {"control.law": law, "initial": at_rest}) == []
    turned = at_rest | {"euler_deg": [100.0, 60.0, 0.0]}
    (note,) = notes_with(weak | {"control.law": law, "initial": turned})
    assert "demands" in note


def test_momentum_beyond_the_wheels(notes_with):
    fine = {"simulation": {"duration_s": 60.0, "step_s": 0.5}}
    three = fine | {"spacecraft.wheels": WHEELS | {"layout": {"kind": "orthogonal"}}}
    reach = 0.5 * np.sqrt(3.0)
    for factor, count in ((0.99, 0), (1.01, 1)):
        rate = np.degrees(factor * reach / 1.3)
        notes = notes_with(three | {"initial.rate_deg_s": [0.0, rate, 0.0]})
        assert len(notes) == count
    assert notes[0] == (
        "the satellite starts with 0.875 N m s more than the body has in the wanted attitude, "
        "but the wheels hold 0.866 N m s at most: they cannot absorb it all"
    )
    # a wheel that turns at the start counts: 6000 rpm are 0.5 N m s
    spun = WHEELS | {"layout": {"kind": "orthogonal"}, "initial_speed_rpm": [0.0, 6000.0, 0.0]}
    rate = np.degrees((0.99 * reach - 0.5) / 1.3)
    spinning = fine | {"spacecraft.wheels": spun}
    assert notes_with(spinning | {"initial.rate_deg_s": [0.0, rate, 0.0]}) == []
    assert len(notes_with(spinning | {"initial.rate_deg_s": [0.0, 1.1 * rate, 0.0]})) == 1


def test_too_long_a_step_with_wheels(notes_with):
    """The splitting knows no wheels."""
    wheels = WHEELS | {"momentum_limit_n_m_s": 5.0}
    (note,) = notes_with({"spacecraft.wheels": wheels, "initial.rate_deg_s": [0.0, 40.0, 0.0]})
    assert note.endswith("take shorter steps, or adaptive ones (no step_s)")


ONE_AXIS = {
    "kind": "wheel_one_axis", "axis": [0, 0, 1], "target": [1, 0, 0], "rate_gain_n_m_s": 0.1,
    "angle_gain_n_m": 0.005, "inertia_kg_m2": [1.0, 1.3, 1.7],
}  # fmt: skip


def test_one_axis_laws_are_looked_at_as_others(notes_with):
    assert notes_with({"control.law": ONE_AXIS}) == []
    (note,) = notes_with({"control.law": ONE_AXIS | {"rate_gain_n_m_s": 2.1}})
    assert note.startswith("the wheel law is unstable with torques held for 1 s")


@pytest.mark.parametrize("kind", ["wheel_pd", "wheel_one_axis"])
def test_turns_for_which_the_wheels_lack_momentum_or_torque(notes_with, kind):
    """1.7 kg m^2 about the heaviest axis; three wheels of 0.5 N m s and 0.05 N m."""
    law = {"wheel_pd": HOLD, "wheel_one_axis": ONE_AXIS}[kind]
    wheels = {"spacecraft.wheels": WHEELS | {"layout": {"kind": "orthogonal"}}}

    def at(rate_deg_s, **limits):
        turn = {"initial": {"euler_deg": [60.0, 0.0, 0.0], "rate_deg_s": [0.0] * 3}}
        changed = {"spacecraft.wheels": wheels["spacecraft.wheels"] | limits}
        return notes_with(
            turn | changed | {"control.law": law | {"greatest_rate_deg_s": rate_deg_s}}
        )

    most_deg_s = np.degrees(0.5 / 1.7)
    assert at(0.99 * most_deg_s) == []
    (note,) = at(1.01 * most_deg_s)
    assert "may take 0.505 N m s, but the wheels hold 0.5 N m s about their weakest axis" in note
    # damping 2 zeta kappa = 0.1 1/s about the fastest axis: 0.33 x 0.1 x 0.4 N m s = 0.0132 N m
    rate_deg_s = np.degrees(0.4 / 1.7)
    assert at(rate_deg_s, torque_limit_n_m=0.0133) == []
    (note,) = at(rate_deg_s, torque_limit_n_m=0.0131)
    assert "takes up to 0.0132 N m to stop, but the wheels give 0.0131 N m" in note


@pytest.mark.parametrize("damping", [0.7, 1.0, 1.4])
def test_torque_at_end_of_turn_stays_within_stated_bound(damping):
    """x'' + 2 zeta x' + x = 0 from x = 2 zeta, x' = -1, where spring and damper balance."""
    t = np.linspace(0.0, 30.0, 30001)
    roots = np.roots([1.0, 2.0 * damping, 1.0]).astype(complex) + np.array([0.0, 1e-9])
    parts = np.linalg.solve(np.vander(roots, increasing=True).T, [2.0 * damping, -1.0])
    braking = np.real(np.exp(np.outer(t, roots)) @ (parts * roots**2)).max() / (2.0 * damping)
    assert 0.05 < braking < 0.33
