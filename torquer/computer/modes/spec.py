"""Mode tables as users write them: regions, states, transitions, conditions by name.

[control.modes.states.damping]
laws = ["bdot"]
transitions = [{ to = "pointing", when = { signal = "rate_deg_s", below = 0.5 }, for_s = 60 }]

[control.modes.states.pointing]
laws = { sdot = 1.0, damping = 0.3 }
transitions = [{ to = "damping", when = { signal = "rate_deg_s", above = 0.7 } }]
"""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from torquer.base.spec import Inertia, Spec, Vector, unit_vector
from torquer.base.validate import storable_name
from torquer.computer.interface import NUMBERS
from torquer.computer.laws.held import Attitude
from torquer.computer.laws.pointing import HeldAttitude
from torquer.computer.modes.packing import check_choice, pack_modes
from torquer.computer.modes.signals import AXES, SIGNALS
from torquer.computer.modes.table import ModeState, ModeTable, Noise
from torquer.spacecraft.data_sheet import Assumed

#: The region of a table that gives its states directly.
MAIN = "main"
#: Names that variables of a result have after `mode_`, where a region's name would stand.
_RESULTS_OWN = ("entered", "entries")
_Time = Annotated[float, Field(gt=0.0)]


def _as_list(value):
    return [value] if isinstance(value, Mapping | Spec) else value


def _as_factors(value):
    """A list of laws as factors of one."""
    if not isinstance(value, list | tuple):
        return value
    for name in value:
        if not isinstance(name, str) or value.count(name) > 1:
            raise ValueError(f"laws: must be names, each once; received {value!r}")
    return dict.fromkeys(value, 1.0)


class Condition(Spec):
    """A signal above or below a value. A time is `above` its value once it has reached it."""

    signal: str
    """Name of the signal; docs/tutorials/modes.md lists them."""
    above: float | None = None
    """The condition holds while the signal is above this value."""
    below: float | None = None
    """The condition holds while the signal is below this value."""
    back_below: float | None = None
    """Hysteresis of `above`: once true, the condition stays true until the signal is below this
    value.
    """
    back_above: float | None = None
    """Hysteresis of `below`: once true, the condition stays true until the signal is above this
    value.
    """
    since_entry: bool = False
    """Compare the signal's change since the state was entered rather than the signal."""
    state: str | None = None
    """State that the signals 'in_state' and 'entries' are about."""
    region: str | None = None
    """Region of that state, where several regions have a state of that name."""
    sensor: str | None = None
    """Sensor that the signals 'reading_age_s', 'estimate_doubts' and 'sensor_suspected' are
    about."""
    coil: str | None = None
    """Body axis, 'x', 'y' or 'z', along which the dipole is that the signal 'coil_suspected' is
    about.
    """
    flag: str | None = None
    """Flag that the signal 'flag' is about, one of `flags` of the mode table."""
    threshold: str | None = None
    """Name by which the value can be changed in flight, as the parameter `modes.NAME`; conditions
    of one name have the same signal and the same value.
    """

    @model_validator(mode="after")
    def _makes_sense(self):
        check_choice("signal", SIGNALS, self.signal)
        if (self.above is None) == (self.below is None):
            received = "none" if self.above is None else "both"
            raise ValueError(f"above, below: one of the two must be given; received {received}")
        self._check_hysteresis()
        self._check_names()
        return self

    @property
    def limit(self) -> float:
        """The value that the signal is compared with."""
        return self.below if self.above is None else self.above

    @property
    def back(self) -> float | None:
        """The value of the hysteresis; None without one."""
        return self.back_above if self.above is None else self.back_below

    @property
    def sign(self) -> float:
        """1 for a signal above the limit, -1 for one below."""
        return -1.0 if self.above is None else 1.0

    def _check_hysteresis(self):
        side, back, other = ("above", "back_below", "back_above")
        if self.above is None:
            side, back, other = ("below", "back_above", "back_below")
        if getattr(self, other) is not None:
            raise ValueError(f"{other}: must not be given with '{side}'; '{back}' is meant")
        if self.back is not None and self.sign * (self.limit - self.back) <= 0.0:
            than = "less" if self.above is not None else "greater"
            raise ValueError(
                f"{back}: must be {than} than '{side}', {self.limit:g}; received {self.back:g}"
            )

    def _check_names(self):
        needs = SIGNALS[self.signal].needs
        for key in ("state", "sensor", "coil", "flag"):
            given = getattr(self, key)
            if key in needs and given is None:
                raise ValueError(f"{key}: must be given for {self.signal}; received none")
            if key not in needs and given is not None:
                raise ValueError(f"{key}: must not be given for {self.signal}; received {given!r}")
        if self.region is not None and self.state is None:
            raise ValueError(f"region: must be given with a state; received {self.region!r}")
        if self.coil is not None:
            check_choice("coil", AXES, self.coil)
        if self.since_entry and SIGNALS[self.signal].unit in ("s", "yes/no", "times"):
            raise ValueError(
                f"since_entry: must not be given for {self.signal}, a time, count or yes/no; "
                "received true"
            )


class Transition(Spec):
    """To another state, once all conditions have held together."""

    to: str
    """State that the transition leads to."""
    when: Annotated[tuple[Condition, ...], BeforeValidator(_as_list)] = ()
    """Conditions, all of which must hold."""
    for_s: float = Field(default=0.0, ge=0.0)
    """Time for which the conditions must have held together."""
    at_least_s: _Time | None = None
    """Time in the state before which the transition is not taken."""
    at_most_s: _Time | None = None
    """Time in the state after which the transition is taken whatever the conditions."""
    back_off: float = Field(default=1.0, ge=1.0)
    """Factor by which at_least_s and at_most_s grow with each entry of the state after the first:
    pauses between attempts become longer and longer.
    """
    most_entries: Annotated[int, Field(ge=1)] | None = None
    """Number of entries of the state after which the transition is not taken any more: so many
    attempts, then none.
    """

    @model_validator(mode="after")
    def _something_fires_it(self):
        if not (self.when or self.at_least_s or self.at_most_s):
            raise ValueError("when: must have a condition, or give at_least_s or at_most_s")
        if self.for_s > 0.0 and not self.when:
            raise ValueError("for_s: needs a condition that is to hold; received times only")
        if self.back_off > 1.0 and not (self.at_least_s or self.at_most_s):
            raise ValueError(
                "back_off: must be given with at_least_s or at_most_s, which it makes longer; "
                f"received {self.back_off:g} alone"
            )
        return self

    @property
    def by_time_only(self) -> bool:
        """Whether `at_most_s` alone fires it."""
        return not self.when and self.at_least_s is None


class State(Spec):
    """What is done in a state, and where it leads."""

    laws: Annotated[dict[str, float], BeforeValidator(_as_factors)] = Field(default_factory=dict)
    """Laws that work in this state, whose commands are added: their names, or a table of names and
    factors.
    """
    estimator: str | None = None
    """Estimator that works in this state, by its name."""
    coils: Literal["on", "off"] | None = None
    """Whether the coils may work."""
    coils_off: tuple[Literal["x", "y", "z"], ...] = ()
    """Body axes along which no dipole is commanded: those of coils that have failed."""
    laws_off: tuple[str, ...] = ()
    """Laws that do not work, whichever state of another region names them: those that use what has
    failed. They are not called.
    """
    wheels: Literal["on", "off"] | None = None
    """Whether the wheels may work."""
    select: dict[str, str] = Field(default_factory=dict)
    """Which of several devices of a kind is read for the kind, `kind = "name"`, in place of what
    `control.select` says.
    """
    set: dict[str, float | tuple[float, ...]] = Field(default_factory=dict)
    """Parameters of laws, `"law.parameter" = number or list`, set on entry and kept until they are
    set again.
    """
    transitions: tuple[Transition, ...] = ()
    """Transitions out of this state; the first whose conditions hold is taken."""
    final: bool = False
    """The state is meant to have no way out."""
    commanded: bool = False
    """The state is meant to be entered by a command from outside, not by a transition."""

    @model_validator(mode="after")
    def _final_is_final(self):
        if self.final and self.transitions:
            raise ValueError("final: must not be true of a state with transitions; received true")
        return self


class Region(Spec):
    """A state machine."""

    states: dict[str, State]
    """States, by names of your choice."""
    initial: str = ""
    """State at the start; left out: the first."""
    transitions: tuple[Transition, ...] = ()
    """Transitions out of any state, tried before those of the state."""

    @model_validator(mode="before")
    @classmethod
    def _first_is_initial(cls, data):
        if isinstance(data, Mapping) and isinstance(data.get("states"), Mapping) and data["states"]:
            return {"initial": next(iter(data["states"])), **data}
        return data

    @property
    def only_guards(self) -> bool:
        """Whether none of its states, two or more, has a law, an estimator or a setting."""
        return len(self.states) > 1 and not any(
            state.laws or state.estimator or state.set for state in self.states.values()
        )

    def all_transitions(self) -> Iterator[tuple[str, Transition]]:
        """Transitions and the keys at which they stand: from any state, then state by state."""
        for i, transition in enumerate(self.transitions):
            yield f"transitions[{i}]", transition
        for name, state in self.states.items():
            for i, transition in enumerate(state.transitions):
                yield f"states.{name}.transitions[{i}]", transition


class SensorNoise(Spec):
    """What checks of the sensors assume of them: 'sensor_suspected', 'coil_suspected',
    'coils_reversed', 'turn_deg_s'.
    """

    assumes: ClassVar = (
        Assumed("magnetometer_noise_nt", "magnetometer", "noise"),
        Assumed("sun_noise_deg", "sun_sensors", "noise"),
        Assumed("gyro_noise_deg_s", "gyro", "noise"),
        Assumed("rate_tolerance_deg_s", "gyro", "bias", sigmas=1.0),
    )
    magnetometer_noise_nt: float = Field(gt=0.0)
    """Standard deviation of each component of a magnetometer reading."""
    sun_noise_deg: float = Field(gt=0.0)
    """Standard deviation of each component of a Sun reading."""
    gyro_noise_deg_s: float = Field(gt=0.0)
    """Standard deviation of each component of a gyro reading."""
    rate_tolerance_deg_s: float = Field(gt=0.0)
    """Difference between the gyro's rate and the one that field and Sun show which is no
    contradiction: it must be above the bias of a sound gyro.
    """

    def pack(self) -> Noise:
        """The standard deviations and the tolerance in SI units, for kernels."""
        degree = math.pi / 180.0
        return Noise(
            1e-9 * self.magnetometer_noise_nt,
            degree * self.sun_noise_deg,
            degree * self.gyro_noise_deg_s,
            degree * self.rate_tolerance_deg_s,
        )


class Modes(Spec):
    """Regions side by side, each in one of its states; or one region's keys directly."""

    axis: unit_vector("axis") | None = None
    """Axis in the body that signals refer to, of any length."""
    target: Literal["sun"] | unit_vector("target") | None = None
    """Direction in the inertial frame that signals refer to, or 'sun'."""
    inertia_kg_m2: Inertia | None = None
    """Inertia from which signals take the angular momentum: three moments or 3x3."""
    wheel_momentum_n_m_s: Vector | None = None
    """Fixed momentum of a wheel in body axes, a part of the angular momentum; left out: none."""
    attitude: HeldAttitude | None = None
    """Wanted attitude, as laws that hold one have it; signals refer to it."""
    attitude_of: str | None = None
    """Name of a law, in place of `attitude`: signals refer to what it holds by its keys, of targets
    to what these give at the time.
    """
    noise: SensorNoise | None = None
    """Noise of the sensors; if it is given, sensors and coils are checked, as the signals
    'sensor_suspected', 'coil_suspected', 'coils_reversed' and 'turn_deg_s' report.
    """
    flags: tuple[str, ...] = ()
    """Flags that software outside raises, by names of your choice; the signal 'flag' is 1 while one
    is raised.
    """
    regions: dict[str, Region]
    """State machines that run side by side, by names of your choice."""

    def guards(self) -> list[str]:
        """The regions that only guard."""
        return [name for name, region in self.regions.items() if region.only_guards]

    @model_validator(mode="before")
    @classmethod
    def _one_region(cls, data):
        if not isinstance(data, Mapping) or "regions" in data:
            return data
        own = {key: data[key] for key in Region.model_fields if key in data}
        return {**{k: v for k, v in data.items() if k not in own}, "regions": {MAIN: own}}

    @model_validator(mode="after")
    def _states_are_known(self):
        if not self.regions:
            raise ValueError("regions: must hold one region or more; received none")
        for name, region in self.regions.items():
            storable_name("regions", name)
            if name in _RESULTS_OWN:
                raise ValueError(
                    f"regions.{name}: must not be named {' or '.join(_RESULTS_OWN)}: "
                    f"mode_{name} is another variable of a result; received {name!r}"
                )
            key, states = self.key_of(name), region.states
            if not states:
                raise ValueError(f"{key}states: must hold one state or more; received none")
            for state in states:
                storable_name(f"{key}states", state)
            check_choice(f"{key}initial", states, region.initial)
            for place, transition in region.all_transitions():
                check_choice(f"{key}{place}.to", states, transition.to)
            for i, transition in enumerate(region.transitions):
                if transition.back_off > 1.0 or transition.most_entries is not None:
                    raise ValueError(
                        f"{key}transitions[{i}]: back_off and most_entries must stand in a state's "
                        "own transition; received one from any state"
                    )
                if any(condition.since_entry for condition in transition.when):
                    raise ValueError(
                        f"{key}transitions[{i}].when.since_entry: must stand in a state's own "
                        "transition; received one from any state"
                    )
        return self

    @model_validator(mode="after")
    def _flags_are_names(self):
        for name in self.flags:
            storable_name("flags", name)
            if self.flags.count(name) > 1:
                raise ValueError(f"flags: must hold each name once; received {name!r} twice")
        return self

    @model_validator(mode="after")
    def _thresholds_agree(self):
        first: dict[str, tuple[str, Condition]] = {}
        for place, condition in self.all_conditions():
            if condition.threshold is None:
                continue
            storable_name(f"{place}.threshold", condition.threshold)
            there, other = first.setdefault(condition.threshold, (place, condition))
            if (condition.signal, condition.limit) != (other.signal, other.limit):
                raise ValueError(
                    f"{place}.threshold: must be of {other.signal} and {other.limit:g} as at "
                    f"{there}, which has the name {condition.threshold!r} too; received "
                    f"{condition.signal} and {condition.limit:g}"
                )
        return self

    @model_validator(mode="after")
    def _one_attitude(self):
        if self.attitude is not None and self.attitude_of is not None:
            raise ValueError(
                f"attitude_of: must be left out where attitude is given; received "
                f"{self.attitude_of!r}"
            )
        return self

    @model_validator(mode="after")
    def _conditions_can_be_evaluated(self):
        for place, condition in self.all_conditions():
            if condition.flag is not None:
                check_choice(f"{place}.flag", self.flags, condition.flag)
            for key in SIGNALS[condition.signal].needs:
                if key == "attitude" and self.attitude_of is not None:
                    continue
                if key in Modes.model_fields and getattr(self, key) is None:
                    signal = condition.signal
                    raise ValueError(f"{key}: must be given for the signal {signal}; received none")
            if condition.state is not None:
                self.find_region(place, condition)
        return self

    def states(self) -> Iterator[State]:
        """All states of all regions."""
        return (state for region in self.regions.values() for state in region.states.values())

    def all_states(self) -> Iterator[tuple[str, State]]:
        """All states and the keys at which they stand."""
        for region, own in self.regions.items():
            for name, state in own.states.items():
                yield f"{self.key_of(region)}states.{name}", state

    @property
    def needs(self) -> frozenset[str]:
        """What the signals of the conditions read that is not always read."""
        signals = [SIGNALS[condition.signal] for _, condition in self.all_conditions()]
        reads = frozenset().union(*(signal.reads for signal in signals))
        sun = self.target == "sun" and any("target" in signal.needs for signal in signals)
        return reads | {"sun"} if sun else reads

    def all_conditions(self) -> Iterator[tuple[str, Condition]]:
        """Conditions and the keys at which they stand."""
        for name, region in self.regions.items():
            for place, transition in region.all_transitions():
                for i, condition in enumerate(transition.when):
                    yield f"{self.key_of(name)}{place}.when[{i}]", condition

    def key_of(self, region: str) -> str:
        """Where a region stands, with its dot; nowhere, if its keys are given directly."""
        return "" if [*self.regions] == [MAIN] else f"regions.{region}."

    def find_region(self, place: str, condition: Condition) -> str:
        """The region whose state a condition names."""
        if condition.region is not None:
            check_choice(f"{place}.region", self.regions, condition.region)
            check_choice(f"{place}.state", self.regions[condition.region].states, condition.state)
            return condition.region
        having = [name for name, r in self.regions.items() if condition.state in r.states]
        if len(having) > 1:
            raise ValueError(
                f"{place}.region: must be one of {', '.join(having)}, which all have a state "
                f"{condition.state!r}; received none"
            )
        known = dict.fromkeys(name for r in self.regions.values() for name in r.states)
        check_choice(f"{place}.state", known, condition.state)
        return having[0]

    def pack(
        self,
        laws: Mapping[str, int],
        estimators: Mapping[str, int] | None = None,
        parameters: Mapping[str, tuple[int, int]] | None = None,
        sensors: Mapping[str, int] | None = None,
        several: tuple[int, ...] = (),
        wanted: Attitude | None = None,
    ) -> tuple[ModeTable, ModeState]:
        """The table as kernels take it, and its state before the first evaluation.

        `laws`, `estimators`: their numbers by name; `parameters`: by `"law.parameter"` the first
        place in the flat array, and how many numbers; `sensors`: their numbers, of a satellite that
        has several of a kind, `several`: the number of the kind of each of these; `wanted`: what
        the law of `attitude_of` holds. ValueError for a name that is not there.
        """
        named = (laws, estimators or {}, parameters or {}, sensors or NUMBERS)
        return pack_modes(self, *named, several, wanted)
