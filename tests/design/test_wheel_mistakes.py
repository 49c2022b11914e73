"""Mistakes about wheels in a scenario: the user's key, what must hold, what was received."""

import pytest
from messages import message_of

import torquer
from torquer.computer.laws import LAWS
from torquer.scenario.load import ScenarioError

HEAD = """
start = 2025-03-01T00:00:00Z
orbit = {{ kind = "circular", altitude_km = 600, inclination_deg = 63.0 }}
initial.rate_deg_s = [0.5, -0.4, 0.3]
spacecraft.body.inertia_kg_m2 = [2.6, 3.1, 1.9]
simulation = {{ duration_s = 200, step_s = 1.0, integrator = {integrator} }}
[control]
{control}
"""
WHEELS = {
    "layout": '{ kind = "regular_pyramid", count = 4, gamma_deg = 54.7 }',
    "momentum_limit_n_m_s": "2.0",
    "torque_limit_n_m": "0.05",
}
PD = 'law = { kind = "wheel_pd", bandwidth_rad_s = 0.1, inertia_kg_m2 = [1, 1, 1] }'
LYAPUNOV = 'law = { kind = "wheel_lyapunov", angle_gain_n_m = 1, inertia_kg_m2 = [1, 1, 1]'
LAYOUTS = "four_sided_pyramid, regular_pyramid, orthogonal, orthogonal_and_skew, icosahedral, axes"
ONE_EACH = "must be one number or one per wheel (4)"
WORKING = "failures: wheel must be another working one from 0 to 3 in each"


def scenario(keys=(), control=PD, integrator='"rk4"', with_wheels=True):
    text = HEAD.format(control=control, integrator=integrator)
    if with_wheels:
        table = {k: v for k, v in {**WHEELS, **dict(keys)}.items() if v is not None}
        text += "[spacecraft.wheels]\n" + "\n".join(f"{k} = {v}" for k, v in table.items())
    return torquer.scenario_from_text(text)


def test_the_scenario_of_these_tests_is_right():
    assert scenario().spacecraft.wheels.array().count == 4


#: (change of spacecraft.wheels, what the one line says after 'spacecraft.wheels.').
KEYS = [
    # missing and unknown
    ({"layout": None}, "layout: must be given; received nothing"),
    ({"momentum_limit_n_m_s": None}, "momentum_limit_n_m_s: must be given; received nothing"),
    ({"torque_limit_n_m": None}, "torque_limit_n_m: must be given; received nothing"),
    ({"speed": "3"}, "speed: must be a known key; received 3 (known: layout, momentum_limit_n_m_s, "
     "torque_limit_n_m, lost, speed_limit_rpm, coulomb_friction_n_m, viscous_friction_n_m_s, "
     "stiction_n_m, speed_noise_rpm, initial_speed_rpm, failures, allocation, "
     "minimum_speed_fraction)"),
    # layout
    ({"layout": '"pyramid"'}, "layout: must be a table of keys; received 'pyramid'"),
    ({"layout": "{}"}, f"layout.kind: must be one of {LAYOUTS}; received nothing"),
    ({"layout": '{ kind = "star" }'}, f"layout.kind: must be one of {LAYOUTS}; received 'star'"),
    ({"layout": '{ kind = "regular_pyramid", count = 2, gamma_deg = 50 }'},
     "layout.count: must be greater than or equal to 3; received 2"),
    ({"layout": '{ kind = "regular_pyramid", count = 13, gamma_deg = 50 }'},
     "layout.count: must be less than or equal to 12; received 13"),
    ({"layout": '{ kind = "regular_pyramid", count = 4, gamma_deg = 90 }'},
     "layout.gamma_deg: must be less than 90; received 90"),
    ({"layout": '{ kind = "four_sided_pyramid", alpha_deg = 0, beta_deg = 3 }'},
     "layout.alpha_deg: must be greater than 0; received 0"),
    ({"layout": '{ kind = "orthogonal", count = 3 }'},
     "layout.count: must be a known key; received 3 (known: kind)"),
    ({"layout": '{ kind = "axes", axes = [[1, 0, 0], [0, 1, 0]] }'},
     "layout.axes: must be 3 to 12; received 2"),
    ({"layout": '{ kind = "axes", axes = [[1, 0, 0], [0, 1, 0], [0, -1, 0]] }'},
     "layout.axes: must hold three that do not lie in one plane; received "
     "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]"),
    ({"layout": '{ kind = "axes", axes = [[1, 0, 0], [0, 1, 0], [0, 0, 0]] }'},
     "layout.axes: must be non-zero vectors of 3 numbers; received "
     "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]"),
    # limits
    ({"momentum_limit_n_m_s": "0"}, "momentum_limit_n_m_s: must be greater than 0; received 0"),
    ({"momentum_limit_n_m_s": "inf"}, "momentum_limit_n_m_s: must be finite; received inf"),
    ({"momentum_limit_n_m_s": '"a"'}, "momentum_limit_n_m_s: must be a number; received 'a'"),
    ({"momentum_limit_n_m_s": "[1, 2, 3]"}, f"momentum_limit_n_m_s: {ONE_EACH}; received 3"),
    ({"momentum_limit_n_m_s": "[1, 2, 3, -1]"},
     "momentum_limit_n_m_s[3]: must be greater than 0; received -1"),
    ({"torque_limit_n_m": "0"}, "torque_limit_n_m: must be greater than 0; received 0"),
    ({"torque_limit_n_m": "[1, 2, 3]"}, f"torque_limit_n_m: {ONE_EACH}; received 3"),
    ({"torque_limit_n_m": "[1, 2, 3, 0]"},
     "torque_limit_n_m[3]: must be greater than 0; received 0"),
    ({"speed_limit_rpm": "0"}, "speed_limit_rpm: must be greater than 0; received 0"),
    ({"speed_limit_rpm": "[1, 2, 3, 4]"},
     "speed_limit_rpm: must be a number; received [1, 2, 3, 4]"),
    # friction and noise
    ({"coulomb_friction_n_m": "-1"},
     "coulomb_friction_n_m: must be greater than or equal to 0; received -1"),
    ({"viscous_friction_n_m_s": "-1"},
     "viscous_friction_n_m_s: must be greater than or equal to 0; received -1"),
    ({"stiction_n_m": "-1"}, "stiction_n_m: must be greater than or equal to 0; received -1"),
    ({"coulomb_friction_n_m": "2e-3", "stiction_n_m": "1e-3"},
     "stiction_n_m: must not be below coulomb_friction_n_m = 0.002; received 0.001"),
    ({"speed_noise_rpm": "-1"},
     "speed_noise_rpm: must be greater than or equal to 0; received -1"),
    # speeds at the start
    ({"initial_speed_rpm": '"a"'}, "initial_speed_rpm: must be a number; received 'a'"),
    ({"initial_speed_rpm": '[1, 2, "a", 3]'},
     "initial_speed_rpm[2]: must be a number; received 'a'"),
    ({"initial_speed_rpm": "[]"}, f"initial_speed_rpm: {ONE_EACH}; received 0"),
    ({"initial_speed_rpm": "[1, 2, 3]"}, f"initial_speed_rpm: {ONE_EACH}; received 3"),
    ({"initial_speed_rpm": "-7000"},
     "initial_speed_rpm: must not exceed speed_limit_rpm = 6000; received -7000.0"),
    ({"initial_speed_rpm": "[1, 2, 3, 600]", "speed_limit_rpm": "500"},
     "initial_speed_rpm: must not exceed speed_limit_rpm = 500; received (1.0, 2.0, 3.0, 600.0)"),
    # losses and failures
    ({"lost": "3"}, "lost: must be a list; received 3"),
    ({"lost": "[1.5]"}, "lost[0]: must be a whole number; received 1.5"),
    ({"lost": "[4]"}, "lost: must be different wheel numbers from 0 to 3; received (4,)"),
    ({"lost": "[0, 0]"}, "lost: must be different wheel numbers from 0 to 3; received (0, 0)"),
    ({"failures": "{ wheel = 1 }"}, "failures: must be a list; received {'wheel': 1}"),
    ({"failures": "[3]"}, "failures[0]: must be a table of keys; received 3"),
    ({"failures": "[{ wheel = 1 }]"}, "failures[0].time_s: must be given; received nothing"),
    ({"failures": "[{ time_s = 1 }]"}, "failures[0].wheel: must be given; received nothing"),
    ({"failures": "[{ wheel = -1, time_s = 1 }]"},
     "failures[0].wheel: must be greater than or equal to 0; received -1"),
    ({"failures": "[{ wheel = 1.5, time_s = 1 }]"},
     "failures[0].wheel: must be a whole number; received 1.5"),
    ({"failures": "[{ wheel = 1, time_s = -1 }]"},
     "failures[0].time_s: must be greater than or equal to 0; received -1"),
    ({"failures": "[{ wheel = 1, time_s = 1, noticed_after_s = -1 }]"},
     "failures[0].noticed_after_s: must be greater than or equal to 0; received -1"),
    ({"failures": "[{ wheel = 1, time_s = 1, noticed_s = 2 }]"},
     "failures[0].noticed_s: must be a known key; received 2 (did you mean noticed_after_s?)"),
    ({"failures": "[{ wheel = 4, time_s = 1 }]"}, f"{WORKING}; received 4"),
    ({"failures": "[{ wheel = 1, time_s = 1 }, { wheel = 1, time_s = 9 }]"},
     f"{WORKING}; received 1"),
    ({"failures": "[{ wheel = 1, time_s = 1 }]", "lost": "[1]"}, f"{WORKING}; received 1"),
    # how a torque is shared
    ({"allocation": '"best"'},
     "allocation: must be 'minimax' or 'least_squares'; received 'best'"),
    ({"minimum_speed_fraction": "0"}, "minimum_speed_fraction: must be greater than 0; received 0"),
    ({"minimum_speed_fraction": "1"}, "minimum_speed_fraction: must be less than 1; received 1"),
    ({"minimum_speed_fraction": "0.1", "allocation": '"least_squares"'},
     "allocation: must be 'minimax' with minimum_speed_fraction; received 'least_squares'"),
]  # fmt: skip


def test_a_mistake_in_the_wheels_is_one_line():
    found = [message_of(scenario, keys) for keys, _ in KEYS]
    assert found == [f"spacecraft.wheels.{line}" for _, line in KEYS]


KINDS = ", ".join(LAWS)
NO_COILS = "spacecraft.coils: must be given for control.{}; received none"
PD_GIVEN = "law = { kind = 'wheel_pd', inertia_kg_m2 = [1, 1, 1], bandwidth_rad_s = "
#: (changed part of the scenario, the lines).
PARTS = [
    ({"with_wheels": False},
     "spacecraft.wheels: must be given for control.law (wheel_pd); received none"),
    ({"control": ""}, "control.law: either it or laws must be given; received neither"),
    ({"control": PD + "\nlaws = { coils = { kind = 'off' } }"},
     "control.law: either it or laws must be given; received both"),
    ({"integrator": '"splitting"'}, "simulation.integrator: must be 'auto' or 'rk4' with "
     "spacecraft.wheels; received 'splitting'"),
    ({"control": "laws.wheels" + PD[3:] + "\nlaws.coils = { kind = 'unloading', gain_per_s = 1 }"},
     NO_COILS.format("laws.coils (unloading)")),
    ({"control": "law = { kind = 'bdot', gain_a_m2_s_per_t = 1e4 }"},
     NO_COILS.format("law (bdot)")),
    ({"control": "law = { kind = 'unloading', gain_per_s = 1e-3 }", "with_wheels": False},
     NO_COILS.format("law (unloading)")),
    ({"control": "laws.wheels = 'off'"},
     "control.laws.wheels: must be a table of keys; received 'off'"),
    ({"control": "laws.wheels = {}"},
     f"control.laws.wheels.kind: must be one of {KINDS}; received nothing"),
    ({"control": "laws.wheels = { kind = 'pd' }"},
     f"control.laws.wheels.kind: must be one of {KINDS}; received 'pd'"),
    ({"control": "law = { kind = 'wheel_pd', bandwidth_rad_s = 1 }"},
     "control.law.inertia_kg_m2: must be given; received nothing"),
    ({"control": PD_GIVEN + "0 }"},
     "control.law.bandwidth_rad_s: must be greater than 0; received 0"),
    ({"control": PD_GIVEN + "1, damping = 0 }"},
     "control.law.damping: must be greater than 0; received 0"),
    ({"control": PD_GIVEN + "1, reference = 'inertial', orbital_rate_rad_s = 1e-3 }"},
     "control.law.orbital_rate_rad_s: must be left out unless the reference is 'orbital'; "
     "received 0.001"),
    ({"control": PD_GIVEN + "1, reference = 'sun' }"},
     "control.law.reference: must be 'orbital' or 'inertial'; received 'sun'"),
    ({"control": LYAPUNOV + "}"},
     "control.law.rate_gain_n_m_s: must be given; received nothing"),
    ({"control": LYAPUNOV + ", rate_gain_n_m_s = 0 }"},
     "control.law.rate_gain_n_m_s: must be greater than 0; received 0"),
    ({"control": LYAPUNOV + ", rate_gain_n_m_s = 1, gravity_feedforward = 3 }"},
     "control.law.gravity_feedforward: must be true or false; received 3"),
    ({"control": "laws.coils = { kind = 'unloading', gain_per_s = 0 }"},
     "control.laws.coils.gain_per_s: must be greater than 0; received 0"),
    ({"control": "laws.coils = { kind = 'unloading', gain_per_s = 1, dead_band_n_m_s = -1 }"},
     "control.laws.coils.dead_band_n_m_s: must be greater than or equal to 0; received -1"),
]  # fmt: skip


def test_a_mistake_about_wheels_elsewhere_is_one_line():
    found = [message_of(lambda part=part: scenario(**part)) for part, _ in PARTS]
    assert found == [line for _, line in PARTS]


def test_rotors_heavier_than_the_body_they_are_part_of():
    with pytest.raises(ScenarioError) as mistake:
        scenario({"speed_limit_rpm": "1"})
    assert str(mistake.value) == (
        "spacecraft.wheels: their rotors' inertia (momentum_limit_n_m_s at speed_limit_rpm) must "
        "be below half of the body's about any axis; received 13.4 of it"
    )


def test_unloading_needs_wheels():
    text = HEAD.format(control="law = { kind = 'unloading', gain_per_s = 1 }", integrator='"rk4"')
    with pytest.raises(ScenarioError) as mistake:
        torquer.scenario_from_text(text + "[spacecraft.coils]\nlimit_a_m2 = 1.0")
    assert str(mistake.value) == (
        "spacecraft.wheels: must be given for control.law (unloading); received none"
    )


def test_a_missing_key_with_the_name_of_the_kind():
    with pytest.raises(ScenarioError) as mistake:
        scenario({"layout": "{ kind = 'axes' }"})
    assert str(mistake.value) == "spacecraft.wheels.layout.axes: must be given; received nothing"


def test_every_mistake_has_its_line():
    with pytest.raises(ScenarioError) as mistake:
        scenario({"speed_noise_rpm": "-1", "minimum_speed_fraction": "2", "lost": '["a"]'})
    assert sorted(line.split(":")[0] for line in str(mistake.value).splitlines()) == [
        "spacecraft.wheels.lost[0]",
        "spacecraft.wheels.minimum_speed_fraction",
        "spacecraft.wheels.speed_noise_rpm",
    ]
