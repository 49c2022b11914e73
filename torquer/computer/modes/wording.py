"""Conditions, transitions and states in words, for diagrams."""

from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Condition, State, Transition

#: Endings of signals' names that only state their unit.
_ENDINGS = ("_deg_s", "_n_m_s", "_deg", "_nt", "_s")


def condition_in_words(condition: Condition) -> str:
    """`rate above 0.7 deg/s, until below 0.5`; `change of rate above 1 deg/s`; `in state b`."""
    unit, above = SIGNALS[condition.signal].unit, condition.above is not None
    value = condition.limit
    if unit == "yes/no" and (0.0 <= value < 1.0 if above else 0.0 < value <= 1.0):
        if condition.signal == "in_state":
            return f"{'in' if above else 'not in'} state {condition.state}"
        if condition.signal == "estimate_doubts":
            verb = "doubts" if above else "does not doubt"
            return f"estimator {verb} {condition.sensor.replace('_', ' ')}"
        if condition.signal in ("sensor_suspected", "coil_suspected"):
            suspect = f"{condition.coil} coil" if condition.coil else condition.sensor
            return f"{suspect.replace('_', ' ')} {'suspected' if above else 'not suspected'}"
        if condition.signal == "flag":
            return f"{condition.flag.replace('_', ' ')} {'raised' if above else 'not raised'}"
        if condition.signal == "coils_reversed":
            return "coils reversed" if above else "coils not reversed"
        return "Sun in view" if above else "Sun not in view"
    change = "change of " if condition.since_entry else ""
    words = f"{change}{_subject(condition)} {'above' if above else 'below'} {value:g}"
    words += f" {unit}" if unit not in ("times", "part", "yes/no") else ""
    if condition.back is not None:
        words += f", until {'below' if above else 'above'} {condition.back:g}"
    return words


def _subject(condition: Condition) -> str:
    if condition.signal == "in_state":
        return f"in state {condition.state}"
    if condition.signal == "entries":
        return f"entries of {condition.state}"
    if condition.signal == "reading_age_s":
        return f"age of {condition.sensor.replace('_', ' ')} reading"
    if condition.signal == "estimate_doubts":
        return f"estimate doubts {condition.sensor.replace('_', ' ')}"
    name = condition.signal
    ending = next((e for e in _ENDINGS if name.endswith(e)), "")
    words = name.removesuffix(ending).split("_")
    return " ".join("Sun" if word == "sun" else word for word in words)


def transition_in_words(transition: Transition) -> str:
    """All conditions and times of a transition."""
    words = " and ".join(map(condition_in_words, transition.when))
    if transition.for_s > 0.0:
        words += f", for {transition.for_s:g} s"
    if transition.at_least_s is not None:
        words += (", " if words else "") + f"after at least {transition.at_least_s:g} s"
    if transition.at_most_s is not None:
        words += (", or " if words else "") + f"after {transition.at_most_s:g} s"
    if transition.back_off > 1.0:
        words += f", longer by a factor of {transition.back_off:g} with each entry"
    if transition.most_entries is not None:
        words += f", up to entry {transition.most_entries}"
    return words


def state_in_words(state: State) -> list[str]:
    """What a state does, line by line."""
    lines = ["by command"] if state.commanded else []
    lines += [name if k == 1.0 else f"{k:g} x {name}" for name, k in state.laws.items()]
    if state.estimator is not None:
        lines.append(f"estimator {state.estimator}")
    lines += [f"{key} {getattr(state, key)}" for key in ("coils", "wheels") if getattr(state, key)]
    lines += [f"{axis} coil off" for axis in state.coils_off]
    lines += [f"{law} off" for law in state.laws_off]
    return lines + [f"{name} = {_numbers(value)}" for name, value in state.set.items()]


def _numbers(value) -> str:
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"
