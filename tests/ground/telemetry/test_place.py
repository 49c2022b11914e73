"""A magnetometer at a place on the ground: |B| is constant, so only turning says anything."""

from datetime import UTC, datetime

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.base.limits import RequestError
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.ground.telemetry.case import check
from torquer.ground.telemetry.reading.positions import FORMS
from torquer.ground.telemetry.request import TelemetryRequest

PLACE = (55.75, 37.6, 150.0)
START = datetime(2012, 3, 4, 10, 0, tzinfo=UTC)
BIAS_NT, NOISE_NT, ROWS = np.array([1500.0, -900.0, 2200.0]), 30.0, 240
COUPLING = np.array([[300.0, 0.0, 50.0], [0.0, -200.0, 0.0], [0.0, 80.0, 150.0]])


def strength_nt():
    """Strength of the model's field there [nT]."""
    t_s = np.zeros(1)
    r = FORMS["position_geodetic"].to_j(np.array([PLACE]), t_s, START)
    along = OrbitEnvironment(Environment(), None, START)
    return 1e9 * float(np.linalg.norm(along.field(t_s, r, r)))


TURNS = {
    "all round": Rotation.random(ROWS, random_state=1),
    "about z": Rotation.from_rotvec(np.outer(np.linspace(0.0, 12.0, ROWS), [0.0, 0.0, 1.0])),
    "not": Rotation.identity(ROWS),
}


def put(folder, turns, dipole=None, more=""):
    rng = np.random.default_rng(2)
    b = strength_nt() * turns.apply(np.array([0.3, 0.2, -np.sqrt(0.87)])) + BIAS_NT
    b += NOISE_NT * rng.normal(size=b.shape)
    head, cells = "t,x,y,z", b
    if dipole is not None:
        head, cells = head + ",mx,my,mz", np.hstack([b + dipole @ COUPLING.T, dipole])
        more += "dipole_body = ['mx', 'my', 'mz']\n"
    stamps = START.timestamp() + 10.0 * np.arange(len(b))
    rows = [
        f"{s:.0f}," + ",".join(f"{x:.4f}" for x in row)
        for s, row in zip(stamps, cells, strict=True)
    ]
    (folder / "a.csv").write_text("\n".join([head, *rows]))
    units = "b_measured = 'nT'\n" + ("dipole_body = 'A m^2'\n" if dipole is not None else "")
    (folder / "m.toml").write_text(
        f"time = 't'\ntime_format = 'unix_s'\nplace = {list(PLACE)}\n[columns]\n"
        f"b_measured = ['x', 'y', 'z']\n{more}[units]\n{units}"
    )
    return folder / "a.csv"


def checked(folder, turns, dipole=None, **asked):
    file = put(folder, turns, dipole)
    return check(file, TelemetryRequest(mapping=folder / "m.toml", **asked))


def test_a_sensor_that_turns_all_round_is_calibrated(tmp_path):
    found = checked(tmp_path, TURNS["all round"])
    assert found.orbit == "a place on the ground, 55.75 37.6 deg, 150 m"
    assert found.is_good and found.calibration.undetermined == ()
    np.testing.assert_allclose(1e9 * found.calibration.bias, BIAS_NT, atol=20.0)


@pytest.mark.parametrize(
    ("turns", "said"),
    [("about z", "bias and scale along z, where no reading turns to"),
     ("not", "bias and scale, as the readings do not turn")],
)  # fmt: skip
def test_what_no_reading_turns_to_is_not_determined(tmp_path, turns, said):
    found = checked(tmp_path, TURNS[turns])
    assert said in found.calibration.undetermined
    assert f"the data do not determine {said}" in [each.text for each in found.findings]
    assert "too short or too still" in found.verdict
    off = np.abs(1e9 * found.calibration.bias - BIAS_NT)
    sigmas = 1e9 * np.array([found.calibration.sigmas[f"bias_{c}"] for c in "xyz"])
    assert (off < 4.0 * sigmas).all() and sigmas[2] > 9000.0


def test_coils_are_fitted_without_a_shift(tmp_path):
    dipole = np.random.default_rng(3).choice([-1.0, 0.0, 1.0], size=(ROWS, 3))
    for asked in ({}, {"model": "coils"}):
        found = checked(tmp_path, TURNS["all round"], dipole, **asked)
        assert "shift" not in found.calibration.groups
        got = [[1e9 * found.calibration.of(f"coil_{a}{c}") for c in "xyz"] for a in "xyz"]
        np.testing.assert_allclose(got, COUPLING, atol=30.0)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"model": "shift"}, "model: must not end in a shift in time where the strength of the "),
        ({"model": "coils"}, "model: must have dipole_body in the telemetry to fit coils; rec"),
        ({"model": "temperature"}, "model: must have temperature in the telemetry to fit temp"),
        ({"orbit": "a.tle"}, "orbit: must be left out where the mapping states a place; recei"),
    ],
)
def test_what_cannot_be_is_one_line(tmp_path, asked, message):
    with pytest.raises(RequestError) as refused:
        checked(tmp_path, TURNS["all round"], **asked)
    assert str(refused.value).startswith(message) and "\n" not in str(refused.value)


@pytest.mark.parametrize("height_m", [-2e4, 1.5e5, 6.4e6])
def test_a_place_is_on_the_ground(tmp_path, height_m):
    file = put(tmp_path, TURNS["not"])
    mapping = (tmp_path / "m.toml").read_text().replace("150.0", f"{height_m}")
    (tmp_path / "m.toml").write_text(mapping)
    with pytest.raises(ValueError, match=r"place: must be latitude .* height \(-5000 to 50000 m"):
        check(file, TelemetryRequest(mapping=tmp_path / "m.toml"))
