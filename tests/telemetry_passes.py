"""Synthetic passes with a known fault: any orbit, motion, sampling and sensor."""

from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Sgp4
from torquer.ground.telemetry.diagnosis.causes import TIMING, Known, Place
from torquer.ground.telemetry.diagnosis.diagnose import diagnose
from torquer.ground.telemetry.diagnosis.fit import Tried, fit
from torquer.ground.telemetry.diagnosis.rows import find_usable

#: Faults and how often each is drawn.
FAULTS = {
    "stated": 0.34, "zone": 0.10, "clock": 0.10, "track": 0.12, "satellite": 0.10, "units": 0.03,
    "lag": 0.10, "frozen": 0.03, "saturated": 0.03, "unlisted": 0.05,
}  # fmt: skip
_ZONES_H = (-8.0, -5.0, -3.0, 1.0, 2.0, 3.0, 4.0, 5.5, 8.0, 9.0)
_BEFORE_S, _STEP_S = 400.0, 0.05


class Pass(NamedTuple):
    """A pass: times [n] s, readings [n, 3] T, rate [n, 3] rad/s in the body, where the satellite
    is said to be, what is known, the fault and its value; `noise_nt` of an axis; `clean` readings
    without noise."""

    t_s: np.ndarray
    b: np.ndarray
    omega: np.ndarray
    place: Place
    known: Known
    fault: str
    value: Any
    noise_nt: float
    clean: np.ndarray
    start: datetime
    tle: tuple[str, str]

    @property
    def span_s(self) -> float:
        return float(self.t_s[-1] - self.t_s[0])


def elements(epoch, inclination, node, eccentricity, perigee, anomaly, revolutions):
    """Two lines of elements with their checksums; angles in deg, revolutions a day."""
    day = (epoch - datetime(epoch.year, 1, 1, tzinfo=UTC)) / timedelta(days=1) + 1
    lines = (
        f"1 38051U 11062C   {epoch.year % 100:02d}{day:012.8f}  .00000500  00000-0  25000-4 0  999",
        f"2 38051 {inclination:8.4f} {node % 360:8.4f} {int(eccentricity * 1e7):07d} "
        f"{perigee % 360:8.4f} {anomaly % 360:8.4f} {revolutions:11.8f}  516",
    )
    return tuple(f"{line[:68].ljust(68)}{_checksum(line)}" for line in lines)


def _checksum(line):
    return sum(int(c) if c.isdigit() else c == "-" for c in line[:68]) % 10


def _draw_orbit(g):
    return [
        g.choice([28.5, 51.6, 66.0, 82.5, 97.6]), g.uniform(0, 360), g.uniform(0.0003, 0.004),
        g.uniform(0, 360), g.uniform(0, 360), g.uniform(14.6, 15.5),
    ]  # fmt: skip


def place_of(tle, start) -> Place:
    """Where elements say that a satellite is."""
    return Place(OrbitEnvironment(Environment(), Sgp4(tle=tle), start))


def make_pass(seed: int, fault: str | None = None, minutes: float | None = None) -> Pass:
    """A pass of 2 min to 10 h; `fault`: one of `FAULTS`, drawn if none is given."""
    g = np.random.default_rng(seed)
    fault = fault or str(g.choice(list(FAULTS), p=list(FAULTS.values())))
    epoch = datetime(2012, 1, 1, tzinfo=UTC) + timedelta(days=float(g.uniform(0, 4300)))
    stated, fleet = _draw_orbit(g), [_draw_orbit(g) for _ in range(4)]
    if g.random() < 0.5:  # a train of one launch
        fleet[0] = stated.copy()
        fleet[0][4] += g.uniform(20, 340)
    age, true = float(g.uniform(0, 3)), stated
    span = 60.0 * (minutes or float(np.exp(g.uniform(np.log(2), np.log(600)))))
    cadence = float(np.exp(g.uniform(0, np.log(60))))
    cadence = max(min(cadence, span / 12), span / 8000)
    start, t_s = epoch + timedelta(days=age), np.arange(0.0, span, cadence)
    value: Any = None
    early = ahead = node_deg = 0.0
    if fault == "zone":
        value = float(g.choice(_ZONES_H))
        early = 3600.0 * value
    if fault == "clock":
        value = early = float(g.choice([-1, 1])) * float(np.exp(g.uniform(np.log(3), np.log(120))))
    if fault == "satellite":
        value = int(g.integers(4))
        true = fleet[value]
    if fault == "unlisted":
        true = _draw_orbit(g)
    if fault == "track":
        age = float(g.uniform(10, 120))
        value = ahead = float(g.normal(0, 0.05 * age**2))
        node_deg = float(g.normal(0, 0.02 * age))
    at = np.arange(-_BEFORE_S, span, min(1.0, cadence)) if fault == "lag" else t_s - early
    place = place_of(elements(epoch, *true), start)
    field, to_body, omega = _field(g, place, at, ahead, node_deg)
    b = np.einsum("nij,nj->ni", to_body, field)
    noise = float(np.exp(g.uniform(np.log(20), np.log(1000))))
    if fault == "lag":
        b, value = _lagged(g, at, b)
        b = np.column_stack([np.interp(t_s, at, axis) for axis in b.T])
        omega = omega[np.searchsorted(at, t_s).clip(None, len(at) - 1)]
    clean, m = _read(g, b, cadence, noise)
    if fault == "lag" and g.random() < 0.5:  # the filter acts on the noise, too
        m = clean + _lagged_noise(g, t_s, value, noise)
    m, value = _spoil(g, fault, m, value)
    others = {str(k): Sgp4(tle=elements(epoch, *each)) for k, each in enumerate(fleet)}
    zone_is_stated = bool(g.random() < 0.4 and fault != "zone")
    tle = elements(epoch, *stated)
    return Pass(
        t_s, 1e-9 * (m if fault == "units" else np.round(m, 1)), omega,
        place_of(tle, start), Known(zone_is_stated, age, others), fault, value, noise,
        1e-9 * clean, start, tle,
    )  # fmt: skip


def _field(g, place: Place, t_s, ahead_s, node_deg):
    """Field [n, 3] nT in J, attitude [n, 3, 3] J to body and rate [n, 3] rad/s of a motion."""
    along = place.environment
    r, v = along.state(t_s + ahead_s)
    if node_deg:
        turn = _turn(2, np.radians([-node_deg]))[0]
        r, v = r @ turn.T, v @ turn.T
    before, to_body, after = np.split(
        _motion(
            g,
            np.concatenate([t_s - _STEP_S, t_s, t_s + _STEP_S]),
            np.concatenate([r - _STEP_S * v, r, r + _STEP_S * v]),
            np.concatenate([v, v, v]),
        ),
        3,
    )
    turn = Rotation.from_matrix(after @ before.transpose(0, 2, 1))
    return 1e9 * along.field(t_s, r, v), to_body, -turn.as_rotvec() / (2.0 * _STEP_S)


def _turn(axis, angle):
    """Rotations [n, 3, 3] of the frame about an axis by angles [n] rad."""
    c, s = np.cos(angle), np.sin(angle)
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    found = np.zeros((len(angle), 3, 3))
    found[:, i, i] = 1.0
    found[:, j, j] = found[:, k, k] = c
    found[:, j, k], found[:, k, j] = s, -s
    return found


def _motion(g, t_s, r, v):
    mode = g.choice(["tumbling", "nadir", "inertial"], p=[0.5, 0.35, 0.15])
    if mode == "tumbling":
        rate = np.radians(np.exp(g.uniform(np.log(0.05), np.log(3))))
        tilt = np.full(len(t_s), g.uniform(0.3, 1.2))
        return _turn(2, rate * t_s) @ _turn(0, tilt) @ _turn(2, 0.31 * rate * t_s + g.uniform(0, 6))
    if mode == "inertial":
        turns = _turn(0, g.uniform(0, 6, 1)) @ _turn(1, g.uniform(0, 6, 1))
        return np.broadcast_to(turns[0], (len(t_s), 3, 3))
    z = -r / np.linalg.norm(r, axis=1)[:, None]
    y = -np.cross(r, v)
    y /= np.linalg.norm(y, axis=1)[:, None]
    orbital = np.stack([np.cross(y, z), y, z], axis=1)
    sway = _turn(1, 0.03 * np.sin(1.9e-3 * t_s)) @ _turn(2, 0.05 * np.sin(1.1e-3 * t_s + 1.0))
    return sway @ orbital


def _lagged(g, at, b):
    """Readings through a filter or a running mean."""
    lag_s, step = float(np.exp(g.uniform(np.log(5), np.log(60)))), at[1] - at[0]
    kind = str(g.choice(["filters", "averages"]))
    if kind == "filters":
        gain = 1.0 - np.exp(-step / lag_s)
        return lfilter([gain], [1.0, gain - 1.0], b, axis=0), (kind, lag_s)
    width = max(int(2.0 * lag_s / step), 1)
    total = np.cumsum(np.vstack([np.zeros(3), b]), axis=0)
    mean = b.copy()
    mean[width - 1 :] = (total[width:] - total[:-width]) / width
    return mean, (kind, 2.0 * lag_s)


def _lagged_noise(g, t_s, lag, noise):
    """Noise [n, 3] nT that went through the filter or mean at ten samples a row."""
    kind, lag_s = lag
    step, more = 0.1 * t_s[1], int(20.0 * lag_s / t_s[1]) + 10
    white = g.normal(0, noise, (10 * (len(t_s) + more), 3))
    if kind == "filters":
        gain = 1.0 - np.exp(-step / lag_s)
        through = lfilter([gain], [1.0, gain - 1.0], white, axis=0)
    else:
        width = max(int(lag_s / step), 1)
        through = lfilter(np.full(width, 1.0 / width), [1.0], white, axis=0)
    return through[10 * more :: 10][: len(t_s)]


def _read(g, b, cadence, noise):
    """Readings [n, 3] nT without noise, and as they are: slow errors, noise, gross rows."""
    rows = len(b)
    decay = np.exp(-cadence / 300.0)
    slow = lfilter([np.sqrt(1.0 - decay**2)], [1.0, -decay], g.normal(size=(rows + 200, 3)), axis=0)
    slow = slow[200:] * g.uniform(5, 50)
    skew = np.tril(g.normal(0, 0.01, (3, 3)), -1)
    matrix = np.eye(3) + np.diag(g.normal(0, 0.015, 3)) + skew
    bias = g.normal(0, 1, 3) * np.exp(g.uniform(np.log(300), np.log(12000)))
    clean = np.linalg.solve(matrix, b.T).T + bias
    m = np.linalg.solve(matrix, (b + slow).T).T + bias + g.normal(0, noise, b.shape)
    gross = g.random(rows) < g.choice([0.0, 0.0, 0.01])
    m[gross] += g.normal(0, 20e3, (gross.sum(), 3))
    return clean, m


def _spoil(g, fault, m, value):
    if fault == "units":
        value = float(g.choice([1e-3, 1e-2, 10.0, 100.0, 1e3]))
        return value * m, value
    if fault == "frozen":
        rows = len(m)
        count = int(g.uniform(0.15, 0.5) * rows)
        first = int(g.integers(1, rows - count))
        m[first : first + count] = m[first]
        return m, count / rows
    if fault == "saturated":
        top = float(np.percentile(np.abs(m), 85))
        return np.clip(m, -top, top), top
    return m, value


def gain_nats(each: Pass) -> float:
    """How much more probable the truth is than 'as stated', by readings without noise."""
    rows = np.linspace(0, len(each.t_s) - 1, min(len(each.t_s), 240)).astype(int)
    strength = each.place.strength(each.t_s[rows])
    m = 1e9 * each.clean[rows]
    found = fit(Tried(m[None], strength[None], np.zeros((1, len(rows), 1)), np.zeros((1, 1))), 15)
    left = np.sqrt(np.mean(found.residual**2))
    return float(0.5 * len(rows) * np.log(1.0 + (left / each.noise_nt) ** 2))


def named(each: Pass) -> tuple[str, tuple[str, ...]]:
    """The verdict on a pass, and its rivals."""
    usable = find_usable(each.t_s, each.b)
    found = diagnose(each.t_s, each.b, each.place, each.known)
    if found is None:
        return "too short", ()
    for key in ("frozen", "saturated"):
        if found.verdict == "stated" and getattr(usable, key).mean() > 0.05:
            return key, found.rivals
    return found.verdict, found.rivals


def is_right(each: Pass, verdict: str, rivals) -> bool:
    """Whether a verdict names the fault: those that |B| cannot tell apart as a set."""
    if each.fault == "unlisted":
        return verdict == "nothing fits"
    if each.fault in TIMING:
        return verdict == each.fault or (verdict in TIMING and each.fault in rivals)
    return verdict == each.fault


def can_be_told(each: Pass) -> bool:
    """Whether the truth is far more probable than 'as stated'."""
    return each.fault in ("units", "frozen", "saturated") or gain_nats(each) > 20.0
