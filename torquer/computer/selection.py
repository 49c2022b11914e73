"""Several devices of a kind on board: which readings the computer takes for those of the kind.

Laws, modes and estimators read a kind of device: 'the magnetometer'. Where a satellite has several,
this is, at each control step, what is made here of their latest readings. Filters take each of the
several as a measurement of its own, but for gyros, which they read as laws do.

A gyro that accumulates angles takes part by its mean rate between the last two control steps at
which it had new readings, of the time half way between them.
"""

import math
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.compile.engine import inlined, kernel
from torquer.computer.interface import GYRO, ROWS, read_six
from torquer.spacecraft.sensors.device import MOST_PARTS

MEAN, VOTE, SPARE = range(3)
HOW = {"mean": MEAN, "vote": VOTE, "spare": SPARE}
#: What a reading is: a vector, a direction (zeros: nothing seen), an attitude, angles.
VECTOR, DIRECTION, ATTITUDE, ANGLES = range(4)
#: A kind that is selected: its number; first and number of its sources; how they become one, what
#: they are, how many numbers they have.
SELECTED = np.dtype(
    [(name, np.int64) for name in ("sensor", "first", "count", "how", "form", "parts")]
    + [("warm_up_s", np.float64)]
)
#: A source: its weight in a mean; age of a reading [s] from which on it is silent; time [s] after
#: which the same numbers are those of a stuck device, infinite for one without noise.
SOURCE = np.dtype([(name, np.float64) for name in ("weight", "silent_s", "stuck_s")])
#: What is kept of a source: a number that changes with its readings, since when it has been the
#: same, when it was last read; angles and their time, rate and its time; 1 while it has failed.
TOTAL, SINCE, SEEN, ANGLE, ANGLE_S, RATE, RATE_S, FAILED = 0, 1, 2, 3, 6, 7, 10, 11
#: What is kept of a kind: the latest reading and its time; which source is in use, of those that
#: stand by, and since when; the one that a mode wants, -1 for none.
READING, TAKEN, ACTIVE, ACTIVE_S, WANTED = 0, 6, 7, 8, 9
KEPT = 12
#: A source is silent after so many of its intervals, stuck after so many, and after at least [s].
_SILENT, _STUCK, _STUCK_S = 3.0, 5.0, 10.0
#: No reading is farther from another: distances can be added.
_FAR = 1e150
#: How much a reading is worth: none; one that is old or stuck; one of a sound device.
_NONE, _DOUBTFUL, _SOUND = 0, 1, 2


def silent_after_s(oldest_s: float) -> float:
    """Age of a reading from which on a source is silent; `oldest_s`: how old they become."""
    return _SILENT * oldest_s


def stuck_after_s(oldest_s: float, may_repeat: bool) -> float:
    """Time after which the same numbers are those of a stuck device; never if it may repeat."""
    return math.inf if may_repeat else max(_STUCK * oldest_s, _STUCK_S)


class Selection(NamedTuple):
    """Constants: kinds that are selected (`SELECTED`), and all devices by number (`SOURCE`)."""

    kinds: np.ndarray
    sources: np.ndarray


NO_SELECTION = Selection(np.zeros(0, SELECTED), np.zeros(0, SOURCE))


def nothing_kept(selection: Selection) -> np.ndarray:
    """What is kept at the start (ROWS, KEPT); without rows where nothing is selected."""
    kept = np.zeros((ROWS if len(selection.kinds) else 0, KEPT))
    selected = {int(kind["sensor"]) for kind in selection.kinds}
    for row in range(len(kept)):
        if row in selected:
            kept[row, TAKEN], kept[row, WANTED] = -math.inf, -1.0
            kept[row, ACTIVE_S] = -math.inf
        else:
            kept[row, [SINCE, SEEN, ANGLE_S, RATE_S]] = -math.inf
    return kept


@kernel
def follow(k, kept, row, form):
    """Take note of a source's latest reading, if it is new."""
    read_s, v, own = k.read_s[row], read_six(k, row), kept[row]
    if not read_s > own[SEEN]:
        return
    total = v[0] + math.pi * (v[1] + math.pi * (v[2] + math.pi * v[3]))
    if total != own[TOTAL] or own[SEEN] == -math.inf:
        own[SINCE] = read_s
    own[TOTAL], own[SEEN] = total, read_s
    if form == ANGLES and math.isfinite(v[0] + v[1] + v[2]):
        interval_s = read_s - own[ANGLE_S]
        if interval_s < math.inf:
            for i in range(3):
                own[RATE + i] = (v[i] - own[ANGLE + i]) / interval_s
            own[RATE_S] = read_s - 0.5 * interval_s
        for i in range(3):
            own[ANGLE + i] = v[i]
        own[ANGLE_S] = read_s


@inlined
def reading_of(k, kept, row, form):
    """(Numbers, time) of what a source gives."""
    own = kept[row]
    if form == ANGLES:
        return (own[RATE], own[RATE + 1], own[RATE + 2], 0.0, 0.0, 0.0), own[RATE_S]
    return read_six(k, row), k.read_s[row]


@inlined
def worth(k, kept, sources, row, form):
    """How much a source's latest reading is worth: see `_NONE`."""
    v, taken_s = reading_of(k, kept, row, form)
    own, source, read_s = kept[row], sources[row], k.read_s[row]
    raw = read_six(k, row)
    known = math.isfinite(v[0] + v[1] + v[2] + v[3]) and math.isfinite(raw[0] + raw[1] + raw[2])
    if not (known and taken_s > -math.inf):
        return _NONE
    sees = form != DIRECTION or v[0] != 0.0 or v[1] != 0.0 or v[2] != 0.0
    silent = k.t_s - read_s > source.silent_s
    stuck = sees and own[SEEN] - own[SINCE] > source.stuck_s
    return _DOUBTFUL if silent or stuck else _SOUND


@inlined
def has_failed(k, kept, sources, row, form):
    """Whether a source that has been read is silent, stuck or reads no number.

    An attitude that is no number is not a failure: a star tracker is blinded.
    """
    if kept[row, SEEN] == -math.inf:
        return False
    v, taken_s = reading_of(k, kept, row, form)
    blinded = form == ATTITUDE and math.isnan(v[0])
    own = worth(k, kept, sources, row, form)
    return own == _DOUBTFUL or (own == _NONE and taken_s > -math.inf and not blinded)


@inlined
def sees(form, v):
    """Whether a reading is one of something."""
    return form != DIRECTION or v[0] * v[0] + v[1] * v[1] + v[2] * v[2] > 0.0


@inlined
def is_used(k, kept, selection, kind, row, least):
    """Whether a source takes part: it is worth that much, and sees as the best do."""
    if worth(k, kept, selection.sources, row, kind.form) < least[0]:
        return False
    v, _ = reading_of(k, kept, row, kind.form)
    return least[1] == 0 or sees(kind.form, v)


@inlined
def greatest_worth(k, kept, selection, kind):
    """(Greatest worth of all sources, 1 if one of these sees something)."""
    best, seeing = _NONE, 0
    for row in range(kind.first, kind.first + kind.count):
        own = worth(k, kept, selection.sources, row, kind.form)
        v, _ = reading_of(k, kept, row, kind.form)
        if own > best:
            best, seeing = own, 1 if sees(kind.form, v) else 0
        elif own == best and sees(kind.form, v):
            seeing = 1
    return best, seeing


@inlined
def normalised(form, v):
    """A sum of directions or attitudes of length one."""
    size = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3])
    if size == 0.0 or form in (VECTOR, ANGLES):
        return v
    return (v[0] / size, v[1] / size, v[2] / size, v[3] / size, 0.0, 0.0)


@kernel
def mean_of(k, kept, selection, kind, least):
    """(Weighted mean of the sources that take part, time of the latest)."""
    x, y, z, w, total, taken_s = 0.0, 0.0, 0.0, 0.0, 0.0, -math.inf
    for row in range(kind.first, kind.first + kind.count):
        if is_used(k, kept, selection, kind, row, least):
            v, read_s = reading_of(k, kept, row, kind.form)
            weight = selection.sources[row].weight
            if kind.form == ATTITUDE and x * v[0] + y * v[1] + z * v[2] + w * v[3] < 0.0:
                weight = -weight
            x, y, z = x + weight * v[0], y + weight * v[1], z + weight * v[2]
            w, total = w + weight * v[3], total + abs(weight)
            taken_s = max(taken_s, read_s)
    mean = (x / total, y / total, z / total, w / total, 0.0, 0.0)
    return normalised(kind.form, mean), taken_s


@inlined
def distance(form, a, b):
    """How far two readings are apart; attitudes that differ by their sign are the same."""
    far = far_2 = 0.0
    for i in range(4):
        far += (a[i] - b[i]) * (a[i] - b[i])
        far_2 += (a[i] + b[i]) * (a[i] + b[i])
    return min(math.sqrt(min(far, far_2) if form == ATTITUDE else far), _FAR)


@kernel
def vote(k, kept, selection, kind, least):
    """The source that is nearest to the others, by the sum of its distances from them.

    One wrong reading among three cannot win, whatever it is.
    """
    best, nearest = -1, math.inf
    for row in range(kind.first, kind.first + kind.count):
        if is_used(k, kept, selection, kind, row, least):
            v, _ = reading_of(k, kept, row, kind.form)
            apart = 0.0
            for other in range(kind.first, kind.first + kind.count):
                if other != row and is_used(k, kept, selection, kind, other, least):
                    u, _ = reading_of(k, kept, other, kind.form)
                    apart += distance(kind.form, v, u)
            if apart < nearest:
                best, nearest = row, apart
    return best


@inlined
def count_used(k, kept, selection, kind, least):
    """How many sources take part."""
    count = 0
    for row in range(kind.first, kind.first + kind.count):
        count += 1 if is_used(k, kept, selection, kind, row, least) else 0
    return count


@inlined
def stand_by(k, kept, selection, kind, least):
    """The source in use: the first at the start, the next sound one once it is not sound.

    It does not return to one that it has left unless that is the only one left. One that has not
    been able to send anything yet, at the start of the run, is not silent.
    """
    own = kept[kind.sensor]
    active = kind.first + int(own[ACTIVE])
    _, taken_s = reading_of(k, kept, active, kind.form)
    is_awaited = taken_s == -math.inf and k.t_s <= selection.sources[active].silent_s
    if is_awaited or is_used(k, kept, selection, kind, active, (least[0], 0)):
        return active
    for step in range(1, kind.count):
        row = kind.first + (int(own[ACTIVE]) + step) % kind.count
        if is_used(k, kept, selection, kind, row, (least[0], 0)):
            own[ACTIVE], own[ACTIVE_S] = float(row - kind.first), k.t_s
            return row
    return active


@inlined
def put_selected(k, kept, sensor, v, taken_s):
    """Let the computer take a reading for that of a kind, unless it has a later one."""
    own = kept[sensor]
    if taken_s < own[TAKEN]:
        return
    for i in range(MOST_PARTS):
        own[READING + i] = v[i]
    own[TAKEN] = taken_s


@inlined
def put_gyros(k, kept, selection, kind, least, row):
    """Say which gyros the rate is of: one of them, or (-1) all that take part."""
    if kind.sensor == GYRO:
        units, bit = 0.0, 1.0
        for each in range(kind.first, kind.first + kind.count):
            takes_part = row < 0 and is_used(k, kept, selection, kind, each, least)
            if each == row or takes_part:
                units += bit
            bit += bit
        k.gyro_units = units


@kernel
def choose(k, kept, selection, kind):
    """Choose the reading of a kind, from what its sources have sent."""
    own, least = kept[kind.sensor], greatest_worth(k, kept, selection, kind)
    wanted = int(own[WANTED])
    if least[0] == _NONE and wanted < 0:
        return
    if wanted >= 0:
        row = wanted
    elif kind.how == SPARE:
        row = stand_by(k, kept, selection, kind, least)
        if k.t_s - own[ACTIVE_S] < kind.warm_up_s:
            return
    elif kind.how == VOTE and count_used(k, kept, selection, kind, least) > 2:
        row = vote(k, kept, selection, kind, least)
    else:
        v, taken_s = mean_of(k, kept, selection, kind, least)
        put_selected(k, kept, kind.sensor, v, taken_s)
        put_gyros(k, kept, selection, kind, least, -1)
        return
    voted = wanted < 0 and kind.how == VOTE
    put_gyros(k, kept, selection, kind, least, -1 if voted else row)
    v, taken_s = reading_of(k, kept, row, kind.form)
    put_selected(k, kept, kind.sensor, v, taken_s)


@kernel
def select(selection, kept, k):
    """Bring up to date what the computer takes for the readings of kinds of several devices."""
    for n in range(selection.kinds.shape[0]):
        kind = selection.kinds[n]
        for row in range(kind.first, kind.first + kind.count):
            follow(k, kept, row, kind.form)
            failed = has_failed(k, kept, selection.sources, row, kind.form)
            kept[row, FAILED] = 1.0 if failed else 0.0
        choose(k, kept, selection, kind)
        own = kept[kind.sensor]
        for i in range(MOST_PARTS):
            k.readings[kind.sensor, i] = own[READING + i]
        k.read_s[kind.sensor] = own[TAKEN]


class SelectionSpec(Spec):
    """How several devices of a kind become what laws and modes read of it."""

    kind: Literal["mean", "vote", "spare"] = "mean"
    """'mean' (of all that seem sound, weighted by their noise), 'vote' (of three or more the one
    nearest to the others) or 'spare': the first, in the order of the file. The next one takes its
    place once it is silent, stuck or not a number.
    """
    warm_up_s: float = Field(default=0.0, ge=0.0)
    """Time after a change to a spare for which it is not used, as one that was off (a cold spare);
    0: it is used at once (a hot spare).
    """

    @model_validator(mode="after")
    def _spares_warm_up(self):
        if self.warm_up_s > 0.0 and self.kind != "spare":
            raise ValueError(
                f"warm_up_s: must be left out for kind {self.kind!r}; received {self.warm_up_s:g}"
            )
        return self
