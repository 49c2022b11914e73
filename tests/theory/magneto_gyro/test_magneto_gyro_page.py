"""Every number of docs/theory/magneto-gyro.md, computed."""

import contextlib
import io
import math
from pathlib import Path

import numpy as np
import pytest

from gallery import gyro
from gallery.entries import mgs_2, mgs_12, mgs_15
from torquer.compile import engine
from torquer.theory.magneto_gyro import comparison
from torquer.theory.magneto_gyro.accuracy import follow_revolution, noise_error, steady_motion
from torquer.theory.magneto_gyro.along_orbit import field_along, model_error
from torquer.theory.magneto_gyro.craft import greatest_tip_off
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Weights, stage_2_gains

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
PAGE = (Path(__file__).parents[3] / "docs/theory/magneto-gyro.md").read_text(encoding="utf-8")
TEXT = " ".join(PAGE.split())
CRAFT, CAPTURE = gyro.CRAFT, gyro.CAPTURE
WEIGHTS = Stage2Weights(angle=27.7, torque=182.0, turning=109.0, constant=45.5)
QUIET = {**gyro.NEARLY, **gyro.EXACT, **gyro.NO_DIPOLE}


@pytest.fixture(scope="module")
def along():
    """The field along the orbit."""
    return gyro.field()


def stated(words):
    assert words in TEXT, words


def degrees(radians):
    return ", ".join(f"{x:.3f}" for x in np.degrees(radians))


def in_flight(changes, orbits=40.0, after=15.0):
    return np.radians(gyro.fly({**QUIET, **changes}, orbits).rms_deg(after))


def rms(motion):
    return np.sqrt(np.mean(motion[:, :3] ** 2, axis=0))


@needs_jit
def test_the_satellite_and_its_field(along):
    stated(f"J = {CRAFT.inertia:.0f} kg m^2, lambda = {CRAFT.pitch_inertia:.3f}, "
           f"h = {CRAFT.stiffness:.2f}")  # fmt: skip
    stated(f"A = {1e9 * along.strength_t:.0f} nT, b = {along.normal:.2f} "
           f"({along.least:.2f} to {along.greatest:.2f} in a day)")  # fmt: skip


@needs_jit
def test_the_errors_that_are_predicted_and_flown(along):
    around = follow_revolution(
        stage_2_loop(CRAFT.satellite(), CRAFT.gyrostat, gyro.GAINS, normal=along.normal)
    )
    noise = [0.0] * 3 + [(1e-6 / along.strength_t) ** 2 * gyro.RATE] * 3
    meter = "spacecraft.magnetometer"
    rows = [("noise of 1000 nT, a reading a second", noise_error(around, noise),
             in_flight({f"{meter}.noise_nt": 1000.0}))]  # fmt: skip
    for k, name in enumerate(("roll", "pitch", "yaw")):
        unit = np.eye(6)[3 + k]
        bias = steady_motion(around, 300e-9 / along.strength_t * unit)
        flown = in_flight({f"{meter}.bias_nt": tuple(300.0 * unit[3:])})
        rows.append((f"bias of 300 nT along {name}", rms(bias), flown))
    for k, name in enumerate(("roll", "pitch", "yaw")):
        torque = steady_motion(around, 2e-4 / CRAFT.torque_unit * np.eye(6)[k])
        flown = in_flight({"disturbance": {"constant_torque_n_m": tuple(2e-4 * np.eye(3)[k])}})
        rows.append((f"torque of 2e-4 N m about {name}", rms(torque), flown))
    quiet = gyro.EXAMPLE.replace("spacecraft.magnetometer.noise_nt", 0.0)
    wrong = field_along(quiet.orbit_environment(), quiet.believed_environment())
    flown = in_flight({"control.ephemeris.field": gyro.EXAMPLE.control.ephemeris.field}, 20.0, 5.0)
    rows.append(("field model on board of degree 8 for 13", model_error(around, wrong), flown))
    for name, exact, flown in rows:
        stated(f"| {name} | {degrees(exact)} | {degrees(flown)} |")
        assert np.linalg.norm(exact) == pytest.approx(np.linalg.norm(flown), rel=0.2)
    parts = [flown / exact for _, exact, flown in rows]
    assert 4.5 < np.max(parts) < 5.5
    push = {"disturbance": {"constant_torque_n_m": (0.0, 2e-4, 0.0)}}
    direct, tilted = (in_flight({**push, "environment.field": {"kind": kind}})
                      for kind in ("direct_dipole", "tilted_dipole"))  # fmt: skip
    stated(f"the simulation has {degrees(direct)} in the field of a dipole along the Earth's axis, "
           f"and {degrees(tilted)} in that of a tilted one")  # fmt: skip


@needs_jit
def test_what_the_dipole_leaves_in_stage_1(along):
    exact, frozen = (
        np.radians(error(along.strength_t, along.normal))
        for error in (mgs_12.exact_error, mgs_12.frozen_error)
    )
    flown = in_flight({"spacecraft.coils.residual_dipole_a_m2": tuple(gyro.RESIDUAL.tolist()),
                       **gyro.STAGE_1_ALONE}, 20.0, 8.0)  # fmt: skip
    stated(f"{degrees(flown)} deg in flight, {degrees(exact)} by the exact model, "
           f"{degrees(frozen)} by the constant one")  # fmt: skip


def unstable(curve, h):
    """Spans of h in which the exact model is unstable and the constant one is not."""
    lost = np.flatnonzero((curve.frozen > 0.0) & (curve.exact <= 0.0))
    return [h[part] for part in np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)]


@needs_jit
def test_the_limits_of_stage_1(along):
    h = np.arange(1, 300) * 0.01 + 0.005
    curve = comparison.stage_1_degrees(CRAFT, CAPTURE, h, along.normal)
    assert (curve.frozen > 0.0).all()
    ends = [mgs_12.span_of(span, along.normal) for span in unstable(curve, h)]
    spans = " and ".join(f"{abs(low):.2f} to {high:.2f}" for low, high in ends)
    stated(f"unstable for h of {spans}")
    own = comparison.stage_1_degrees(CRAFT, CAPTURE, normal=along.normal)
    stated(f"{own.frozen:.3f} by the constant model and {own.exact:.3f} exactly")
    bound = 2.0 * CAPTURE.damping * CAPTURE.frequency * CRAFT.pitch_inertia
    n = np.arange(50.0, 110.0, 0.5)
    gains = comparison.CaptureGains(CAPTURE.angle_gain, n, CAPTURE.frequency, CAPTURE.damping)
    found = comparison.stage_1_degrees(CRAFT, gains, normal=along.normal)
    edges = [n[np.flatnonzero(each > 0.0)[-1]] for each in found]
    stated(f"2 xi omega lambda = {bound:.0f}; the constant model is stable up to n = "
           f"{edges[0]:.0f}, the exact one up to {edges[1]:.0f}")  # fmt: skip
    filters = math.degrees(gyro.LAW.filter_rate_rad_s)
    braked = math.degrees(greatest_tip_off(gyro.LAW.filter_rate_rad_s))
    stated(f"{filters:.2f} deg/s: {braked:.2f} deg/s are braked")


@needs_jit
def test_the_degree_of_stage_2_over_h(along):
    values = (1.0, 1.5, 2.1, 2.5, 3.0, 4.0, 6.46, 10.0)
    crafts = [CRAFT.with_wheel(CRAFT.wheel_at(h)) for h in values]
    found = comparison.stage_2_degrees(
        crafts, lambda craft: stage_2_gains(craft, WEIGHTS), normal=along.normal
    )
    for name, row in zip(("constant model", "exact model"), found, strict=True):
        stated(f"| {name} | " + " | ".join(f"{x:.3f}" for x in row) + " |")


@needs_jit
def test_the_constant_model_is_no_certificate(along):
    plain = stage_2_gains(CRAFT.gyrostat, mgs_15.PLAIN)
    own = comparison.stage_2_degrees(
        [CRAFT], lambda _: plain, normal=along.normal, form="text"
    )  # fmt: skip
    stated(f"decay with {own.frozen[0]:.3f} nu0")
    stated(f"Floquet degree of {own.exact[0]:.3f}")
    flown = gyro.fly({**gyro.NEARLY, **gyro.text_form(plain)}, 20.0)
    stated(f"{flown.angle_deg[flown.orbits > 19.0].max():.0f} deg off after 20 orbits")


@needs_jit
def test_the_dipole_that_a_bias_is_taken_for(along):
    rule = CRAFT.bias_dipole(300e-9, along.mean_square_t2)
    loop = stage_2_loop(CRAFT.satellite(), CRAFT.gyrostat, gyro.GAINS, normal=along.normal)
    bias = [0.0, 0.0, 0.0, 0.0, 300e-9 / along.strength_t, 0.0]
    exact = -steady_motion(follow_revolution(loop), bias)[:, 13].mean() * CRAFT.torque_unit
    flown = mgs_2.alias() * rule
    stated(f"300 nT make {rule:.1f} A m^2, {exact / along.strength_t:.1f} by the exact model, "
           f"{flown:.1f} in flight")  # fmt: skip
    tolerable = 0.05 * np.linalg.norm(gyro.RESIDUAL) / (rule / 300.0)
    stated(f"5 % of {np.linalg.norm(gyro.RESIDUAL):.1f} A m^2 is that of {tolerable:.0f} nT")


@needs_jit
def test_what_the_compensator_learns():
    flown = gyro.fly(gyro.EXACT, 16.0)
    stated(f"within 5 % after {mgs_2.time_to_learn(flown, 0.05):.1f} orbits of stage 2, within 1 % "
           f"after {mgs_2.time_to_learn(flown, 0.01):.1f}")  # fmt: skip


def test_the_block_of_python_prints_what_is_shown():
    code, rest = PAGE.split("```python\n")[1].split("```", 1)
    shown = rest.split("```\n")[1].split("```")[0]
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(code, {})
    assert printed.getvalue() == shown


def test_the_rows_that_are_shown_are_printed(capsys):
    pytest.importorskip("sympy")
    from torquer.cli import main

    _, command = PAGE.split("```sh\n")
    words, _, shown = command.split("```")[:3]
    with pytest.raises(SystemExit):
        main(words.split()[1:])
    out = capsys.readouterr().out
    lines = shown.strip("\n").splitlines()
    assert len(lines) > 6 and all(f"{line}\n" in out for line in lines)
