"""Linear equations of a held attitude from the kernels, and their exact stability."""

import math
from dataclasses import replace

import numpy as np
import pytest
from attitude_holds import CUBESAT, at_strength, damping, gains_of, hold
from law_cases import inputs
from scipy.spatial.transform import Rotation

import torquer
from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.computer.laws.bdot import Bdot
from torquer.computer.laws.pointing import deviation, reference_motion
from torquer.environment.field import averaged
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply
from torquer.maths.geometry.vec3 import add, cross, scale
from torquer.scenario.load import scenario_from_data
from torquer.theory.periodic import floquet
from torquer.theory.periodic.periodic_systems import periodic_system
from torquer.theory.three_axis.floquet import exact_stability, fit_family, stability_chart

ALONE = np.empty((1, 0))


def skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


# the linear equations


@pytest.mark.parametrize("reference", ["inertial", "orbital"])
def test_law_is_a_spring_and_damper_across_the_field(reference):
    held = hold(50.0, reference=reference, field="igrf14", revolutions=1, euler_deg=(40, -20, 10))
    at = held.instants(np.linspace(0.0, 6.0, 7))
    k, k_a = gains_of(held)
    b = held.to_body(at, at.b_t)
    wanted = np.array([-np.hstack([2.0 * k_a * skew(x), k * held.rate_rad_s * skew(x)]) for x in b])
    assert held.gains(at) == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())
    assert held.free(np.linspace(0.0, 6.0, 7)).b_body_t == pytest.approx(b, abs=1e-9 * 4e-5)


def test_free_motion_in_the_orbital_frame_is_the_textbook_one():
    """J theta'' and the gravity gradient about the orbital axes, by hand.

    Axes along the motion, normal, up; roll, pitch, yaw of small turns on a circular orbit:
    roll'' = -4 (J2 - J3)/J1 roll + (J1 - J2 + J3)/J1 yaw', pitch'' = -3 (J1 - J3)/J2 pitch,
    yaw'' = -(J2 - J1)/J3 yaw - (J1 - J2 + J3)/J3 roll', the normal being axis 2.
    """
    j1, j2, j3 = 1.3, 1.7, 0.8
    held = hold(60.0, (j1, j2, j3), reference="orbital", gravity_gradient=True)
    free = held.free(np.linspace(0.0, 6.2, 9))
    wanted = np.zeros((3, 6))
    wanted[0, 0], wanted[0, 5] = -4.0 * (j2 - j3) / j1, -(j1 - j2 + j3) / j1
    wanted[1, 1] = -3.0 * (j1 - j3) / j2
    wanted[2, 2], wanted[2, 3] = -(j2 - j1) / j3, (j1 - j2 + j3) / j3
    assert free.slopes == pytest.approx(np.broadcast_to(wanted, (9, 3, 6)), abs=1e-9)
    assert free.forcing == pytest.approx(np.zeros((9, 3)), abs=1e-9)


def test_free_motion_in_inertial_space_is_gravity_alone():
    """About an inertial attitude: 3 n^2 e x J e and its slope by a small turn, by hand."""
    inertia = np.diag([1.3, 1.7, 0.8])
    held = hold(60.0, (1.3, 1.7, 0.8), gravity_gradient=True)
    u = np.linspace(0.0, 6.2, 9)
    at, free = held.instants(u), held.free(u)
    for e, slopes, forcing in zip(
        held.to_body(at, at.r_m / np.linalg.norm(at.r_m, axis=1)[:, None]), free.slopes,
        free.forcing, strict=True,
    ):  # fmt: skip
        torque = 3.0 * np.cross(e, inertia @ e)
        # the turn theta takes e to e + e x theta
        change = 3.0 * (skew(e) @ inertia - skew(inertia @ e)) @ skew(e)
        assert forcing == pytest.approx(np.linalg.solve(inertia, torque), abs=1e-9)
        assert slopes[:, :3] == pytest.approx(np.linalg.solve(inertia, change), abs=1e-9)
        assert slopes[:, 3:] == pytest.approx(np.zeros((3, 3)), abs=1e-9)


def test_a_wheel_stiffens_the_motion():
    """A fixed momentum h: J w' = -w x h about an inertial attitude."""
    held = hold(30.0)
    body = held.body.model_copy(update={"wheel_momentum_n_m_s": (0.0, 0.002, 0.001)})
    held = replace(held, body=body)
    slopes = held.free(np.zeros(1)).slopes[0]
    wanted = held.inverse_inertia @ skew([0.0, 0.002, 0.001]) / held.rate_rad_s
    assert slopes[:, 3:] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("reference", ["inertial", "orbital"])
def test_the_transition_matrix_is_that_of_the_simulation(reference):
    """A revolution of the whole loop, from six small displacements, sampled every half second.

    Without gravity gradient for the inertial reference, as it would drive the motion far off.
    """
    gravity, period_s = reference == "orbital", 5500.0
    altitude_km = 1e-3 * (np.cbrt(MU_EARTH_M3_S2 * (period_s / 2 / np.pi) ** 2) - EARTH_RADIUS_M)
    held = hold(
        51.0, (1.1, 1.6, 0.9), "igrf14", reference, 8e5, 120.0, gravity, altitude_km, revolutions=1
    )  # fmt: skip
    made, size = fit_family(held, tolerance=1e-11).monodromies(ALONE)[0], 1e-4
    scenario = scenario_from_data({
        "start": "2025-03-01T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": altitude_km, "inclination_deg": 51.0},
        "environment": {"gravity_gradient": gravity},
        "spacecraft": {"body": {"inertia_kg_m2": [1.1, 1.6, 0.9]}, "coils": {"limit_a_m2": 1e3}},
        "initial": {"rate_deg_s": [0, 0, 0]},
        "control": {"law": {"kind": "off"}, "sample_s": 0.5},
        "simulation": {"duration_s": period_s, "record_s": 10.0},
    })  # fmt: skip
    ends = []
    for axis in range(-1, 6):
        x = np.zeros(6)
        if axis >= 0:
            x[axis] = size
        ends.append(flown(held, scenario, x))
    found = (np.array(ends[1:]) - ends[0]).T / size
    assert found == pytest.approx(made, abs=3e-3 * np.abs(made).max())


def flown(held, scenario, x):
    """State at the end of a flight from a state at its start."""
    start = held.instants(np.zeros(1))
    q0, omega0 = wanted_motion(held, start)
    q = multiply(q0, from_rotation_vector(tuple(x[:3])))
    turn = np.array(from_rotation_vector(tuple(-x[:3])))
    omega = rotated(turn, omega0) + held.rate_rad_s * x[3:]
    initial = {"quaternion": list(q), "rate_deg_s": np.degrees(omega).tolist()}
    run = torquer.simulate(scenario.replace("initial", initial), law=held.law)
    span = float(run.time[-1])
    at = held.instants(np.array([span * held.rate_rad_s]))
    q0, omega0 = wanted_motion(held, at)
    error = multiply((-q0[0], -q0[1], -q0[2], q0[3]), tuple(run.q_body_to_inertial.values[-1]))
    theta = 2.0 * np.sign(error[3]) * np.array(error[:3])
    carried = rotated(np.array([*(-0.5 * theta), 1.0]), omega0)
    return np.append(theta, (run.omega_body.values[-1] - carried) / held.rate_rad_s)


def rotated(q, v):
    return Rotation.from_quat(q).apply(v)


def wanted_motion(held, at):
    """Wanted attitude, and its rate in its own axes, at one instant."""
    known = inputs(r=at.r_m[0], v=at.v_m_s[0])
    q, turning = reference_motion(known, held.reference.orbital)
    q = multiply(q, held.reference.q_wanted)
    return q, rotated(np.array([-q[0], -q[1], -q[2], q[3]]), turning)


# exact stability


@periodic_system(order=6, period=2.0 * math.pi, parameters={"k": 0.1, "k_a": 0.1, "cone": 1.0})
def by_hand(u, parameters, out):
    """J w' = (b b^T - 1)(k w + 2 k_a theta), theta' = w, J = diag(1, 2, 1.5), b of length 1."""
    b = averaged.b_z(1.0, u, parameters[2])
    for i in range(3):
        for j in range(6):
            out[i, j] = out[3 + i, j] = 0.0
        out[3 + i, i] = 1.0
        for j in range(3):
            across = (b[i] * b[j] - (1.0 if i == j else 0.0)) / (1.0, 2.0, 1.5)[i]
            out[i, j] = parameters[0] * across
            out[i, 3 + j] = 2.0 * parameters[1] * across


def hand_made(held):
    """The monodromy matrix by the general integrator, from equations written by hand."""
    b0 = np.linalg.norm(held.free(np.zeros(1)).b_body_t)
    k, k_a = gains_of(held)
    cone = averaged.cone_angle(math.radians(held.orbit_environment.orbit.inclination_deg))
    n = held.rate_rad_s
    found = floquet.monodromy(by_hand, k=k * b0**2 / n, k_a=k_a * b0**2 / n**2, cone=cone)
    order = [3, 4, 5, 0, 1, 2]
    return found[np.ix_(order, order)]


@pytest.mark.parametrize(
    ("inclination", "strength", "ratio"), [(30, 0.3, 1), (70, 2, 2), (30, 4, 1)]
)
def test_the_monodromy_matrix_is_that_of_equations_by_hand(inclination, strength, ratio):
    held = at_strength(hold(inclination), strength, ratio)
    found, wanted = fit_family(held, tolerance=1e-11).monodromies(ALONE)[0], hand_made(held)
    assert found == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())


def test_exact_and_averaged_degrees_differ_by_square_of_gains():
    strengths = np.array([0.05, 0.1, 0.2, 0.4])
    apart = []
    for strength in strengths:
        found = exact_stability(at_strength(hold(30.0), float(strength)))
        apart.append(1.0 - found.degree / found.averaged_degree)
    slope = np.polyfit(np.log(strengths), np.log(apart), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.05)
    assert apart[0] == pytest.approx(2.4e-4, abs=1e-5)


@pytest.mark.parametrize(
    ("strength", "part"), [(0.5, 0.976), (1.0, 0.907), (2.0, 0.675), (4.0, 0.284)]
)
def test_the_part_of_the_averaged_degree_that_is_left(strength, part):
    """On the edge of the plateau at 30 deg, as gains grow."""
    found = exact_stability(at_strength(hold(30.0), strength))
    assert found.degree / found.averaged_degree == pytest.approx(part, abs=6e-4)


@pytest.mark.parametrize(("inclination", "onset"), [(30.0, 0.514), (70.0, 0.390)])
def test_the_position_gain_alone_makes_it_unstable(inclination, onset):
    """MAG Fig. 4.4.2: at K = 0.05 from this K_a on, where the averaged theory sees nothing."""
    held = at_strength(hold(inclination), 0.05)
    unit = held.rate_rad_s**2 / (damping(held)[0, 0] / held.body.inertia_kg_m2[0][0])
    for k_a, stable in ((onset - 0.004, True), (onset + 0.004, False)):
        there = held.with_parameters(angle_gain=k_a * unit)
        found = exact_stability(there)
        assert (found.degree > 0.0) == stable and found.averaged_degree > 0.008
        rho = floquet.multipliers(hand_made(there))
        assert floquet.degree_of_stability(rho, 2.0 * math.pi) == pytest.approx(
            found.degree, abs=1e-8
        )


def test_gravity_makes_a_weak_inertial_hold_unstable():
    """It has a mean torque and slope in inertial space, which the averaged theory leaves out."""
    weak = at_strength(hold(70.0, gravity_gradient=True), 0.5)
    strong = at_strength(hold(70.0, gravity_gradient=True), 3.0)
    assert exact_stability(weak).degree < -0.3
    assert exact_stability(strong).degree > 0.3


def test_a_chart_is_its_points():
    held = at_strength(hold(70.0), 1.0)
    k, k_a = gains_of(held)
    xs, ys = np.array([0.1, 0.8, 2.5]) * k, np.array([0.05, 0.5, 1.0, 6.0]) * k_a
    chart = stability_chart(held, ("rate_gain", xs), ("angle_gain", ys))
    assert chart.degree_of_stability.dims == ("angle_gain", "rate_gain")
    for i, y in enumerate(ys):
        for j, x in enumerate(xs):
            one = exact_stability(held.with_parameters(rate_gain=x, angle_gain=y))
            assert float(chart.degree_of_stability[i, j]) == pytest.approx(one.degree, abs=1e-6)
            assert float(chart.averaged_degree[i, j]) == pytest.approx(
                one.averaged_degree, abs=1e-6
            )


def scaled_law(inputs, parameters, memory):
    """Lovera and Astolfi's scaling: m = (e^2 k_a S + e k w) x B, not affine in e."""
    q, turning = reference_motion(inputs, parameters.orbital)
    error, omega = deviation(inputs, parameters.q_wanted, q, turning)
    s = scale(4.0 * error[3], (error[0], error[1], error[2]))
    spring = scale(parameters.e * parameters.e * parameters.k_a, s)
    return cross(add(spring, scale(parameters.e * parameters.k, omega)), inputs.b_body_t)


def scaled(held, k, k_a):
    parameters = {"e": 1.0, "k": k, "k_a": k_a, "orbital": 0.0, "q_wanted": held.reference.q_wanted}
    law = torquer.law(parameters=parameters, needs=("attitude", "rate"))(scaled_law)
    return replace(held, law=law)


def test_any_law_that_is_a_kernel_has_its_chart():
    """Parameters in which it is not affine are linearised again at every point."""
    held = at_strength(hold(70.0), 1.0)
    k, k_a = gains_of(held)
    own = scaled(held, k, k_a)
    xs, ys = np.array([0.5, 1.0, 1.4]), np.array([0.6, 1.2]) * k
    chart = stability_chart(own, ("e", xs), ("k", ys))
    for i, y in enumerate(ys):
        for j, x in enumerate(xs):
            same = held.with_parameters(rate_gain=x * y, angle_gain=x * x * k_a)
            found, exact = chart.isel(e=j, k=i), exact_stability(same)
            assert float(found.degree_of_stability) == pytest.approx(exact.degree, abs=1e-6)
            assert float(found.averaged_degree) == pytest.approx(exact.averaged_degree, abs=1e-6)


def test_field_turning_with_earth_repeats_after_about_a_day():
    held = at_strength(hold(field="igrf14", **CUBESAT), 1.5)
    assert held.revolutions == 15
    degrees = [exact_stability(replace(held, revolutions=n), 1e-9).degree for n in (15, 30, 46)]
    assert degrees == pytest.approx([degrees[-1]] * 3, rel=0.02)
    fixed = at_strength(hold(field="direct_dipole", **CUBESAT), 1.5)
    assert fixed.revolutions == 1
    assert exact_stability(fixed).degree == pytest.approx(degrees[-1], rel=0.2)


# what linear theory refuses


def held_by(function, **keys):
    parameters = {"orbital": 0.0, "q_wanted": (0.0, 0.0, 0.0, 1.0)}
    return replace(hold(), law=torquer.law(parameters=parameters, **keys)(function))


def test_laws_without_linear_theory_are_refused():
    def biased(inputs, parameters, memory):
        return (1e-3, 0.0, 0.0)

    def relay(inputs, parameters, memory):
        x, y, z = inputs.omega_body_rad_s
        return (1e-3 if x > 0.0 else -1e-3, 1e-6 * y, 1e-6 * z)

    at = hold().instants(np.zeros(1))
    with pytest.raises(ValueError, match=r"law bdot: must hold an attitude \(parameters orbital"):
        replace(hold(), law=Bdot(gain_a_m2_s_per_t=1.0).law())
    with pytest.raises(
        ValueError, match=r"law biased: must answer with a dipole and have no memory .* 3 cells"
    ):
        held_by(biased, memory=3)
    with pytest.raises(ValueError, match=r"law biased: must be smooth|must ask for no dipole"):
        held_by(biased).gains(at)
    with pytest.raises(ValueError, match="law relay: must be smooth about the wanted attitude"):
        held_by(relay).gains(at)
    with pytest.raises(ValueError, match="revolutions: must be at least 1; received 0"):
        hold(revolutions=0)
    with pytest.raises(ValueError, match="chart: x and y must be two parameters"):
        stability_chart(hold(), ("rate_gain", [1.0, 2.0]), ("rate_gain", [1.0, 2.0]))
    with pytest.raises(ArithmeticError, match=r"the monodromy matrix must settle .*gains too high"):
        fit_family(hold(k=3e9, k_a=1e6))


def test_a_scenario_gives_its_hold():
    text = """
start = 2025-03-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 350
inclination_deg = 30.0
[environment]
field = { kind = "averaged" }
gravity_gradient = false
[spacecraft.body]
inertia_kg_m2 = [1.0, 2.0, 1.5]
[spacecraft.coils]
limit_a_m2 = 100.0
[initial]
rate_deg_s = [0, 0, 0]
[control]
law = { kind = "three_axis", rate_gain_n_m_s_per_t2 = 1e5, angle_gain_n_m_per_t2 = 30.0 }
[simulation]
revolutions = 1
"""
    scenario = torquer.scenario_from_text(text)
    made = torquer.theory.AttitudeHold.of_scenario(scenario)
    assert made.law.name == "three_axis" and made.reference.orbital == 1.0
    same = replace(made, law=hold().law)
    assert exact_stability(same).degree == pytest.approx(exact_stability(hold()).degree, rel=1e-9)
