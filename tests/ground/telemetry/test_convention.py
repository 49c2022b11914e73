"""Conventions of quaternions and axes, from telemetry whose convention is known."""

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground.telemetry.convention import find_convention


@pytest.fixture(scope="module")
def along(make):
    scenario = make({"environment": {"field": {"kind": "igrf14"}, "earth_rotation": "precise"}})
    return OrbitEnvironment(scenario.environment, scenario.orbit, scenario.start)


def telemetry(along, *, moving=True, noise=0.005, frame="J2000", scalar="last", inverse=False):
    """Readings along an hour; the sensor's axes are y, -x, z of the body, as seen from it."""
    rng, t_s = np.random.default_rng(1), np.linspace(0.0, 3600.0, 60)
    turns = Rotation.random(60, random_state=2) if moving else Rotation.identity(60)
    r, v = along.state(t_s)
    found = {"b_measured": along.field(t_s, r, v), "sun_measured": along.sun(t_s) - r}
    lit = along.sunlit_fraction(t_s, r) > 0.5
    data = {}
    for name, vector in found.items():
        vector = vector / np.linalg.norm(vector, axis=1)[:, None]
        body = turns.inv().apply(vector) + noise * rng.normal(size=(60, 3))
        data[name] = (("time", "axis"), np.stack([body[:, 1], -body[:, 0], body[:, 2]], axis=1))
    data["sun_measured"][1][~lit] = 0.0
    if frame == "ECEF":
        turns = Rotation.from_matrix(along.dcm_to_ecef(t_s)) * turns
    q = (turns.inv() if inverse else turns).as_quat()
    q = np.roll(q, 1, axis=1) if scalar == "first" else q
    q[5] = 1e-4  # near zero: not a quaternion
    data["q_measured"] = (("time", "component"), q)
    return xr.Dataset(data, coords={"time": t_s})


@pytest.mark.parametrize("sensor", ["field", "sun"])
@pytest.mark.parametrize("scalar", ["last", "first"])
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("frame", ["J2000", "ECEF"])
def test_order_sense_frame_and_axes_are_found(along, sensor, scalar, inverse, frame):
    given = telemetry(along, frame=frame, scalar=scalar, inverse=inverse)
    best = find_convention(given, along, sensor=sensor).ways[0]
    sense = "reference to body" if inverse else "body to reference"
    assert (best.scalar, best.sense, best.axes) == (scalar, sense, ("-y", "x", "z"))
    assert not best.is_reflection
    # TEME is turned from J2000 by 0.17 deg in 2012: below the noise of single readings
    assert best.frame == frame if frame == "ECEF" else best.frame in ("J2000", "TEME")
    assert 0.2 < best.error_deg < 0.6  # noise of 0.005 rad about two axes: 0.41 deg


def test_frames_within_the_noise_are_not_distinguished(along):
    found = find_convention(telemetry(along, noise=0.05), along)
    assert len(found.rivals) > 1
    assert found.is_wrong and "TEME or J2000, axes" in found.verdict


def test_another_convention_is_wrong_though_two_frames_fit(along):
    """J2000 and TEME differ by less than the noise; order and sense do not."""
    found = find_convention(telemetry(along, scalar="first", inverse=True), along)
    assert found.is_wrong and len(found.rivals) > 1 and not found.agrees
    text = "with scalar first, reference to body, "
    assert text in found.verdict and " or " in found.verdict and "as they are" in found.verdict


def test_quaternions_as_sessions_have_them_agree(along):
    given = telemetry(along)
    b = given["b_measured"].values
    given["b_measured"].values[:] = np.stack([-b[:, 1], b[:, 0], b[:, 2]], axis=1)
    found = find_convention(given, along)
    assert found.agrees and not found.is_wrong
    assert found.verdict.startswith("quaternions and field agree to 0.")
    assert 0.2 < found.stated.error_deg < 0.6 < found.ways[5].error_deg


def test_random_quaternions_say_nothing(along):
    given = telemetry(along)
    given["q_measured"].values[:] = Rotation.random(60, random_state=7).as_quat()
    found = find_convention(given, along)
    assert not found.is_wrong and not found.agrees
    assert "do not know" in found.verdict


def test_accurate_readings_tell_j2000_from_teme(along):
    found = find_convention(telemetry(along, noise=1e-5), along)
    assert len(found.rivals) == 1
    assert found.ways[0].frame == "J2000"


def test_a_reflection_is_named(along):
    given = telemetry(along)
    given["b_measured"].values[:, 2] *= -1.0
    best = find_convention(given, along).ways[0]
    assert best.axes == ("-y", "x", "-z")
    assert best.is_reflection


def test_constant_attitude_does_not_tell_the_sense(along):
    found = find_convention(telemetry(along, moving=False, noise=0.0), along)
    assert len(found.rivals) > 1


def test_mistakes_are_named(along):
    given = telemetry(along)
    with pytest.raises(ValueError, match=r"sensor: must be 'field' or 'sun'; received 'moon'"):
        find_convention(given, along, sensor="moon")
    with pytest.raises(ValueError, match="must have q_measured for its convention"):
        find_convention(given.drop_vars("q_measured"), along)
    with pytest.raises(ValueError, match=r"must have 3 usable rows .* received 2"):
        find_convention(given.isel(time=slice(2)), along)
