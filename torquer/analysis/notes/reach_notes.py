"""What actuators can do about each axis, and what is asked of their momentum."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.scenario.spec import Scenario
from torquer.spacecraft.wheel_array.envelope import momentum_envelope, support

#: Part of the reach about the strongest axis below which there is none about another: the axes lie
#: within a degree of a plane or a line, as near as they are mounted.
_NO_REACH = 0.02
#: Cosine of the angle from which two axes count as parallel, 1 deg.
_PARALLEL = float(np.cos(np.radians(1.0)))


class _Array(NamedTuple):
    """Actuators along axes: the key, what they are called, axes (n, 3), limits (n,), unit."""

    key: str
    name: str
    axes: np.ndarray
    limits: np.ndarray
    unit: str


def reach_notes(scenario: Scenario) -> list[str]:
    """Notes on axes about which actuators cannot act, and on momentum that wheels cannot hold."""
    arrays = _arrays(scenario)
    return [
        *(note for array in arrays for note in _axis_notes(array)),
        *notes_on_laws(scenario, {"the momentum that the law wants": _momentum_notes}),
    ]


def _arrays(scenario: Scenario) -> Iterator[_Array]:
    """Coils; wheels by their momentum, or by their torque where only this is too little."""
    coils, wheels = scenario.spacecraft.coils, scenario.spacecraft.wheels
    if coils is not None:
        limits = coils.limits_a_m2()
        yield _Array("spacecraft.coils.axes", "coils", np.array(coils.axes), limits, "A m^2")
    if wheels is not None:
        array = wheels.array()
        works = array.momentum_limits() > 0.0
        axes, torques = np.array(array.axes)[works], array.torque_limits()[works]
        by_momentum = _Array(
            "spacecraft.wheels.layout", "wheels", axes, array.momentum_limits()[works], "N m s"
        )
        by_torque = by_momentum._replace(limits=torques, unit="N m")
        yield by_torque if not _weak_axes(by_momentum) else by_momentum


def _reach(array: _Array) -> tuple[np.ndarray, np.ndarray]:
    """Reach along the principal axes of an array, from the strongest on, and these axes."""
    vectors = array.limits[:, None] * array.axes
    principal = np.linalg.svd(vectors)[2]
    return support(vectors, principal), principal


def _weak_axes(array: _Array) -> int:
    """About how many axes three actuators or more do not act; fewer are meant to."""
    along, _ = _reach(array)
    return int(np.sum(along < _NO_REACH * along[0])) if len(array.axes) >= 3 else 0


def _axis_notes(array: _Array) -> Iterator[str]:
    weak, (along, principal) = _weak_axes(array), _reach(array)
    if not weak:
        return
    own, unit = f"{array.key}: the {len(array.axes)} {array.name}", array.unit
    least, most = f"{along[-1]:.2g} {unit}", f"{along[0]:.3g} {unit}"
    if weak == 2:
        yield (
            f"{own} reach {most} along {_in_words(principal[0])} in the body, and {least} across "
            f"it: they cannot act about the other axes{_parallel(array)}"
        )
    else:
        yield (
            f"{own} reach {least} along {_in_words(principal[-1])} in the body, where they are "
            f"weakest, and {most} where they are strongest: they cannot act along this axis"
            f"{_parallel(array)}"
        )


def _in_words(axis: np.ndarray) -> str:
    """An axis with its greatest component positive."""
    return str((np.round(axis * np.sign(axis[np.argmax(np.abs(axis))]), 2) + 0.0).tolist())


def _parallel(array: _Array) -> str:
    """Which actuators are parallel, up to three pairs."""
    cosines = np.abs(np.triu(array.axes @ array.axes.T, 1))
    pairs = [f"{i} and {j}" for i, j in np.argwhere(cosines > _PARALLEL).tolist()]
    if not pairs:
        return ""
    others = " and others" if len(pairs) > 3 else ""
    return f": {array.name} {', '.join(pairs[:3])}{others} are parallel"


def _momentum_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """A momentum that a law wants of the wheels, and they cannot hold."""
    wheels, key = scenario.spacecraft.wheels, getattr(use.law, "momentum_key", "")
    if wheels is None or not key:
        return
    wanted = np.array(getattr(use.law, key), dtype=np.float64)
    if wanted.ndim == 0:
        axis_key = getattr(use.law, "momentum_axis_key", "")
        wanted = wanted * np.array(getattr(use.law, axis_key))
    if not np.any(wanted):
        return
    envelope = momentum_envelope(wheels.array())
    if envelope.share(wanted) > 1.0:
        yield (
            f"{key} of {np.linalg.norm(wanted):.3g} N m s is beyond the "
            f"{envelope.extent(wanted):.3g} N m s that the wheels hold in this direction: they "
            "saturate, and the attitude is lost"
        )
