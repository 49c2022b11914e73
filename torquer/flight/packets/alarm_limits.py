"""When a field is out of limits: ranges, labels, bits, by mode. Checked here, judged on the ground.

A `warning` is to be looked at, an `alarm` to be acted on. Limits of a mode replace the field's own
while the mode is in one of its states; with nothing else stated the field is not checked then.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Literal, Self

import pydantic
from pydantic import AfterValidator, model_validator

from torquer.base.spec import Spec

#: How bad a violation is, the lesser first.
SEVERITIES = ("warning", "alarm")
#: In `values`, for whichever bit is set.
ANY = "any"


def _differ(states: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(states)) < len(states):
        raise ValueError("must differ from each other")
    return states


_Finite = Annotated[float, pydantic.Field(allow_inf_nan=False)]
#: Least and greatest value.
Ends = tuple[_Finite, _Finite]
Severity = Literal["warning", "alarm"]


class Beyond(Spec):
    """What is out of limits, in the field's unit."""

    limits: Ends | None = None
    """Least and greatest value that is in order; beyond, it is a warning."""
    critical: Ends | None = None
    """Least and greatest value beyond which it is an alarm."""
    values: dict[str, Severity] = pydantic.Field(default_factory=dict)
    """Labels, or names of bits that are set, that are a warning or an alarm; `any`: whichever bit.
    """

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        check_ranges(self.limits, self.critical)
        return self


class ModeLimits(Beyond):
    """Limits while a mode is in one of some states."""

    mode: str
    """`packet.number` of telemetry with labels, or a region of the mode table."""
    states: Annotated[tuple[str, ...], AfterValidator(_differ)] = pydantic.Field(min_length=1)
    """Labels of the number, or states of the region."""

    @property
    def place(self) -> tuple[str, str] | None:
        """Packet and number of the mode; None of a region."""
        packet, dot, number = self.mode.partition(".")
        return (packet, number) if dot else None


class AlarmKeys(Spec):
    """When a field raises an alarm, besides its `limits`."""

    critical: Ends | None = None
    """Least and greatest value beyond which it is an alarm."""
    values: dict[str, Severity] = pydantic.Field(default_factory=dict)
    """Labels, or names of bits that are set, that are a warning or an alarm; `any`: whichever bit.
    """
    samples: int = pydantic.Field(default=1, ge=1, le=1000)
    """Consecutive samples out of limits, or back in them, before it counts."""
    latched: bool = False
    """Whether an alarm that is over stays until it is cleared."""
    by_mode: tuple[ModeLimits, ...] = pydantic.Field(default=(), max_length=100)
    """Limits by mode in place of the field's own; the first whose mode is in its states."""


def check_ranges(limits: Ends | None, critical: Ends | None) -> None:
    """ValueError for ranges that are none, and for a warning that comes after the alarm."""
    for key, ends in (("limits", limits), ("critical", critical)):
        if ends and not ends[0] <= ends[1]:
            raise ValueError(f"{key}: must be [least, greatest]; received {list(ends)}")
    if limits and critical and not (critical[0] <= limits[0] and limits[1] <= critical[1]):
        must = f"must enclose limits, {list(limits)}"
        raise ValueError(f"critical: {must}; received {list(critical)}")


def check_alarm(
    limits: Ends | None,
    alarm: AlarmKeys | None,
    is_number: bool,
    labels: Iterable[str],
    bits: Iterable[str],
) -> None:
    """ValueError with one line for limits that a field cannot have."""
    if limits and not is_number:
        raise ValueError(f"limits: must be of numbers; received {list(limits)}")
    check_ranges(limits, alarm.critical if alarm else None)
    if alarm is None:
        return
    known = [*labels, *bits, *([ANY] if bits else [])]
    own = Beyond(critical=alarm.critical, values=alarm.values)
    for place, each in (("alarm", own), *_places(alarm)):
        if not is_number and (each.critical or each.limits):
            raise ValueError(f"{place}: must have no ranges but of numbers; received one")
        for name in each.values:
            if name not in known:
                must = f"one of {', '.join(known)}" if known else "left out without labels and bits"
                raise ValueError(f"{place}.values: must be {must}; received {name!r}")


def _places(alarm: AlarmKeys) -> Iterator[tuple[str, ModeLimits]]:
    for k, each in enumerate(alarm.by_mode):
        yield f"alarm.by_mode[{k}]", each


def check_modes(
    place: str, alarm: AlarmKeys, modes: Mapping[str, Iterable[str]], are_open: bool
) -> None:
    """ValueError with one line for a mode that is none.

    `modes`: the states of each mode; `are_open`: whether regions are not known yet.
    """
    for key, each in _places(alarm):
        if are_open and each.place is None:
            continue
        if each.mode not in modes:
            raise ValueError(
                f"{place}.{key}.mode: must be packet.number of telemetry with labels, or a region "
                f"of the mode table; received {each.mode!r}"
            )
        known = list(modes[each.mode])
        for state in each.states:
            if state not in known:
                raise ValueError(
                    f"{place}.{key}.states: must be of {', '.join(known)}; received {state!r}"
                )


def alarm_in_words(limits: Ends | None, alarm: AlarmKeys | None) -> str:
    """Limits in a line: `-30 to 30; alarm beyond -60 to 60; 3 samples; SCIENCE: -1 to 1`."""
    critical, values = (alarm.critical, alarm.values) if alarm else (None, {})
    parts = _parts(limits, critical, values)
    if alarm and alarm.samples > 1:
        parts.append(f"{alarm.samples} samples")
    if alarm and alarm.latched:
        parts.append("latched")
    for each in alarm.by_mode if alarm else ():
        stated = ", ".join(_parts(each.limits, each.critical, each.values)) or "not checked"
        parts.append(f"{each.mode} {' or '.join(each.states)}: {stated}")
    return "; ".join(parts)


def _parts(
    limits: Ends | None,
    critical: Ends | None,
    values: Mapping[str, str],
) -> list[str]:
    parts = ["{:.12g} to {:.12g}".format(*limits)] if limits else []
    if critical:
        parts.append("alarm beyond {:.12g} to {:.12g}".format(*critical))
    return parts + [f"{severity} {name}" for name, severity in values.items()]
