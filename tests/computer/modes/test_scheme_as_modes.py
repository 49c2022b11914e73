"""A scheme is a chain of modes: it switches at the readings at which a scheme's rules say."""

import math

import numpy as np
import pytest
from flown_modes import Flown, J, Z, reading
from hypothesis import given, settings, strategies as st
from scheme_twin import SchemeTwin

from torquer.computer.laws.recommended import recommended_scheme, standard_scheme
from torquer.computer.modes.scheme import DONE, as_modes
from torquer.computer.scheme import Scheme

UNTIL = {
    "nutation_below_deg": st.sampled_from([5.0, 30.0, 80.0, 120.0]),
    "axis_to_target_below_deg": st.sampled_from([10.0, 60.0, 125.0, 180.0]),
    "momentum_to_target_below_deg": st.sampled_from([20.0, 70.0, 150.0]),
    "spin_above_deg_s": st.sampled_from([0.1, 2.0]),
    "rate_below_deg_s": st.sampled_from([0.5, 4.0, 7.0]),
    "at_least_s": st.sampled_from([0.3, 2.0, 7.0]),
    "at_most_s": st.sampled_from([0.9, 6.0, 25.0]),
    "for_s": st.sampled_from([0.3, 1.0, 2.5, 6.0]),
}
OFF = [{"kind": "off"}]


def is_until(data):
    """What `Until` takes: something that ends the stage, something that is to hold for `for_s`."""
    times = data.keys() & {"at_least_s", "at_most_s"}
    waits = data.keys() - {"at_least_s", "at_most_s", "for_s"}
    return bool(waits) or (bool(times) and "for_s" not in data)


untils = st.fixed_dictionaries({}, optional=UNTIL).filter(is_until)
schemes = st.builds(
    lambda ends, last, target: Scheme(
        target=target, inertia_kg_m2=J, axis=(0.0, 0.6, 0.8),
        stages=[{"laws": OFF, "until": end} for end in ends] + ([{"laws": OFF}] if last else []),
    ),
    st.lists(untils, min_size=1, max_size=4), st.booleans(),
    st.sampled_from(["sun", (1.0, 2.0, -2.0)]),
)  # fmt: skip


def flight(seed, count=80):
    """Readings that change now and then: turning or at rest, with and without the Sun."""
    rng, t, rows = np.random.default_rng(seed), 0.7 * (seed % 3), []
    step = rng.choice([0.1, 0.5, 1.0])
    for _ in range(count):
        if not rows or rng.random() < 0.25:
            omega = rng.normal(size=3) * rng.choice([0.0, 1e-3, 0.03, 0.1])
            sun = rng.normal(size=3) * rng.choice([0.0, 1.0, 1.0])
            q = rng.normal(size=4)
        sun = sun / (np.linalg.norm(sun) or 1.0)
        q = q / np.linalg.norm(q)
        rows.append((t, *(tuple(v.tolist()) for v in (omega, sun, q))))
        t += step
    return rows


def reading_of(row):
    """A row of a flight as inputs."""
    t, omega, sun, q = row
    return reading(t, sun=sun, omega_body_rad_s=omega, q_body_to_inertial=q)


def stages_of(scheme, rows):
    """The stage after each reading, by the twin in plain Python."""
    twin = SchemeTwin(scheme)
    return [twin(reading_of(row)) for row in rows]


@settings(deadline=None, max_examples=100, derandomize=True)
@given(schemes, st.integers(0, 10**6))
def test_it_switches_when_the_scheme_does(scheme, seed):
    rows = flight(seed)
    flown = Flown(as_modes(scheme)[0])
    found = flown.states(map(reading_of, rows))
    assert [flown.names.index(name) + 1 for name in found] == stages_of(scheme, rows)


@pytest.mark.parametrize("key", ["nutation_below_deg", "momentum_to_target_below_deg"])
def test_rest_ends_a_momentum_hold_as_in_the_scheme(key):
    """A body at rest has no momentum whose angle could be below anything."""
    until = {key: 30.0, "for_s": 3.0}
    scheme = Scheme(target=Z, inertia_kg_m2=J, stages=[{"laws": OFF, "until": until}])
    spins = [0.1, 0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1]
    rows = [(float(t), (0.0, 0.0, w), Z, (0.0, 0.0, 0.0, 1.0)) for t, w in enumerate(spins)]
    found = Flown(as_modes(scheme)[0]).states(map(reading_of, rows))
    assert found == ["stage_1"] * 8 + ["done"] * 2
    assert stages_of(scheme, rows) == [1] * 8 + [2] * 2


def test_the_flights_of_this_test_go_through_the_stages():
    """Else it would compare nothing."""
    until = {"axis_to_target_below_deg": 60.0, "rate_below_deg_s": 4.0, "for_s": 0.3}
    scheme = Scheme(target="sun", stages=[{"laws": OFF, "until": until}] * 3)
    ends = [stages_of(scheme, flight(seed))[-1] for seed in range(40)]
    assert len(set(ends)) >= 3 and 4 in ends


DAMPING = {"kind": "nutation_damping_rate", "gain_a_m2_s_per_t": 1e5}
COMMON = {
    "target": [1.0, 1.0, 0.0],
    "inertia_kg_m2": J,
    "spin_deg_s": 10.0,
    "nutation_damping": {"relay_dipole_a_m2": 0.8},
    "spin_up": {"gain_a_m2_per_t": 1e4},
    "reorientation": {"relay_dipole_a_m2": 0.6},
}


def laws_of(data):
    """Laws by states, of a scheme given as data."""
    modes, laws = as_modes(Scheme.model_validate(data))
    states = modes.regions["main"].states
    return {name: [laws[law].kind for law in state.laws] for name, state in states.items()}


def test_the_schemes_of_spin_stabilisation_are_mode_tables():
    weak = {"gain_a_m2_per_t": 1e4}
    assert laws_of(standard_scheme(**COMMON)) == {
        "stage_1": ["nutation_damping"], "stage_2": ["spin_up"], "stage_3": ["reorientation"],
    }  # fmt: skip
    assert laws_of(recommended_scheme(10.0, preliminary=weak, **COMMON)) == {
        "stage_1": ["nutation_damping", "preliminary_2"],
        "stage_2": ["spin_up"],
        "stage_3": ["reorientation"],
    }
    assert laws_of(recommended_scheme(60.0, preliminary=weak, **COMMON)) == {
        "stage_1": ["nutation_damping", "preliminary_1"],
        "stage_2": ["nutation_damping"],
        "stage_3": ["spin_up"],
        "stage_4": ["reorientation"],
    }


def test_a_recommended_scheme_damps_spins_up_and_turns():
    """Nutation 60 deg, then none for a minute; then a slow and a fast enough spin."""
    modes, _ = as_modes(Scheme.model_validate(standard_scheme(**COMMON)))

    def turning(t, angle_deg, spin_deg_s):
        momentum = (math.sin(math.radians(angle_deg)), 0.0, math.cos(math.radians(angle_deg)))
        scale = math.radians(spin_deg_s) / (momentum[2] / J[2])
        return reading(
            t, omega_body_rad_s=[scale * x / j for x, j in zip(momentum, J, strict=True)]
        )

    rows = [turning(t, 60.0, 2.0) for t in range(0, 100, 10)]
    rows += [turning(t, 3.0, 2.0) for t in range(100, 200, 10)]
    rows += [turning(t, 3.0, 11.0) for t in range(200, 220, 10)]
    found = Flown(modes).states(rows)
    assert found == ["stage_1"] * 16 + ["stage_2"] * 4 + ["stage_3"] * 2


def test_each_stage_has_laws_of_its_own():
    """Two of a kind in one stage, and the same again in the next: four memories."""
    stage = {"laws": [DAMPING, DAMPING], "until": {"at_most_s": 5.0}}
    modes, laws = as_modes(Scheme(stages=[stage, stage]))
    assert [*laws] == [
        "stage_1_nutation_damping_rate", "stage_1_nutation_damping_rate_2",
        "stage_2_nutation_damping_rate", "stage_2_nutation_damping_rate_2",
    ]  # fmt: skip
    assert modes.regions["main"].states[DONE].final and modes.axis == Z


@pytest.mark.parametrize("target", ["sun", (1.0, 0.0, 0.0)])
def test_only_an_angle_to_the_sun_asks_for_its_view(target):
    until = {"axis_to_target_below_deg": 5.0}
    modes, _ = as_modes(Scheme(target=target, stages=[{"laws": OFF, "until": until}]))
    (way,) = modes.regions["main"].states["stage_1"].transitions
    signals = [condition.signal for condition in way.when]
    assert signals == ["axis_to_target_deg"] + ["sun_in_view"] * (target == "sun")
