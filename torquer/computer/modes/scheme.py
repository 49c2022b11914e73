"""A scheme as the chain of modes that it is: `stage_1`, `stage_2`, ..., `done`."""

from torquer.computer.modes.spec import Condition, Modes, State, Transition
from torquer.computer.scheme import Scheme, Stage, Until

DONE = "done"
#: Signal and side of the keys of `until`.
_CONDITIONS = {
    "nutation_below_deg": ("nutation_deg", "below"),
    "axis_to_target_below_deg": ("axis_to_target_deg", "below"),
    "momentum_to_target_below_deg": ("momentum_to_target_deg", "below"),
    "spin_above_deg_s": ("spin_deg_s", "above"),
    "rate_below_deg_s": ("rate_deg_s", "below"),
}
#: In a scheme an angle that is not known is not below anything, which ends a hold; in a mode
#: table it would only stop it.
_IN_VIEW = Condition(signal="sun_in_view", above=0.5)
_TURNING = Condition(signal="rate_deg_s", above=0.0)


def as_modes(scheme: Scheme) -> tuple[Modes, dict]:
    """(mode table, laws by the names that it uses); each stage has laws of its own."""
    named = [_name_laws(number, stage) for number, stage in enumerate(scheme.stages, start=1)]
    names = [*(f"stage_{number}" for number in range(1, len(named) + 1)), DONE]
    states = {}
    for name, after, laws, stage in zip(names, names[1:], named, scheme.stages, strict=False):
        onward = () if stage.until is None else (_transition(stage.until, after, scheme.target),)
        states[name] = State(laws=[*laws], transitions=onward, final=not onward)
    if scheme.stages[-1].until is not None:
        states[DONE] = State(final=True)
    modes = Modes(
        axis=scheme.axis, target=scheme.target, inertia_kg_m2=scheme.inertia_kg_m2, states=states
    )
    return modes, {name: law for laws in named for name, law in laws.items()}


def _name_laws(number: int, stage: Stage) -> dict:
    """A stage's laws by name; the place distinguishes a second one of a kind."""
    found = {}
    for place, law in enumerate(stage.laws, start=1):
        name = f"stage_{number}_{law.kind}"
        found[f"{name}_{place}" if name in found else name] = law
    return found


def _transition(until: Until, to: str, target) -> Transition:
    given = {key: value for key in _CONDITIONS if (value := getattr(until, key)) is not None}
    conditions = [
        Condition(signal=signal, **{side: given[key]})
        for key, (signal, side) in _CONDITIONS.items()
        if key in given
    ]
    if target == "sun" and any("target" in key for key in given):
        conditions.append(_IN_VIEW)
    if given.keys() & {"nutation_below_deg", "momentum_to_target_below_deg"}:
        conditions.append(_TURNING)
    times = {"at_least_s": until.at_least_s, "at_most_s": until.at_most_s}
    return Transition(to=to, when=conditions, for_s=until.for_s, **times)
