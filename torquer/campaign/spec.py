"""The table `[campaign]` of a scenario file: what varies, in how many runs, which outcomes."""

import math
import re
from collections.abc import Iterator
from html import escape
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Field, WithJsonSchema, model_validator

from torquer.base.spec import Spec
from torquer.campaign.outcomes import DEFAULT, Outcome, Threshold
from torquer.campaign.plain import completed
from torquer.campaign.table import check_table
from torquer.campaign.variation import ATTITUDE, Correlated, Variation

#: Name of the success of all conditions, where outcomes are named.
SUCCESS = "success"
#: Names that a result has for something else.
_TAKEN = (SUCCESS, "succeeded", "member", "time", "seed", "how_it_ended", "ended")
#: Numbers that a Latin hypercube may have, as it is in memory as a whole.
MOST_IN_HYPERCUBE = 50_000_000
_MOST_RUNS = 100_000_000
#: Members are counted in a 32-bit word of the generator's counter.
MOST_MEMBERS = 2**32
_Listed = Annotated[tuple[Any, ...], Field(min_length=1)]
#: What editors take as the `table` of a file.
_ALSO_A_FILE = WithJsonSchema(
    {"anyOf": [{"type": "string"}, {"type": "object", "additionalProperties": {"type": "array"}}]}
)
#: Keys that each member has for itself.
_OWN = ("name", "description", "seed")
_NAME = re.compile(r"[A-Za-z_]\w*")
#: Keys in one way of writing: they are the names of variables in the result.
_KEY = re.compile(r"[\w-]+(\[\d+\])*(\.[\w-]+(\[\d+\])*)*")


class Stop(Spec):
    """The campaign ends early once an outcome's confidence interval is narrow enough.

    Not while a member has no value: the mean of the others is not that of the campaign.
    """

    outcome: str
    """The outcome whose mean is watched, or 'success' for the success rate."""
    half_width: float = Field(gt=0.0, le=1e300)
    """Half width of the confidence interval at which the campaign ends, in the outcome's unit."""
    confidence: float = Field(default=0.95, gt=0.0, lt=1.0)
    """Probability that the interval covers the true value."""
    least: int = Field(default=100, ge=2)
    """Number of members to fly before the campaign may end."""


def _or_default(outcomes: dict[str, Outcome]) -> dict[str, Outcome]:
    return outcomes or dict(DEFAULT)


def _runs_may_follow(schema: dict) -> None:
    """In the schema for editors: a table's rows, or a grid's combinations, are the runs."""
    schema["required"] = [key for key in schema["required"] if key != "runs"]
    grid = {"properties": {"sampling": {"const": "grid"}}, "required": ["sampling"]}
    schema["anyOf"] = [{"required": ["runs"]}, {"required": ["table"]}, grid]


class Campaign(Spec):
    """Many runs of a scenario, with keys that vary from member to member."""

    model_config = ConfigDict(json_schema_extra=_runs_may_follow)

    runs: int = Field(ge=1, le=_MOST_RUNS)
    """Number of members; with a `table` left out for one of each row, else at most so many."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Seed: with a member's number it determines everything random in that member, whichever other
    members are flown.
    """
    sampling: Literal["random", "latin_hypercube", "sobol", "saltelli", "grid"] = "random"
    """How runs are drawn: 'random' (independently), 'latin_hypercube' (the runs together cover the
    range of each number evenly), 'sobol' (a scrambled low-discrepancy sequence, best for powers of
    2), 'saltelli' or 'grid'. The points of 'saltelli', for Sobol's sensitivity indices, are those
    of such a sequence, each with two runs and one more for every key that varies. Those of 'grid'
    are all combinations of the `values`: their number must equal the number of runs.
    """
    vary: dict[str, Variation] = Field(default_factory=dict)
    """How each key varies, by keys of the scenario as `Scenario.replace` takes them;
    "initial.attitude" for uniformly distributed attitudes.
    """
    table: Annotated[dict[str, _Listed], _ALSO_A_FILE] = Field(default_factory=dict)
    """Keys whose values are listed for each member, by keys of the scenario; in a file the path of
    a CSV file: names of keys in its first line, then one row a member. Columns KEY[0], KEY[1], ...
    make a vector. What varies besides is drawn as it is without a table.
    """
    correlated: tuple[Correlated, ...] = ()
    """Keys with a joint normal distribution, of their values or of changes to those of the file."""
    outcomes: Annotated[dict[str, Outcome], AfterValidator(_or_default)] = Field(
        default_factory=lambda: dict(DEFAULT)
    )
    """Numbers taken from each run, under names of your choice."""
    success: dict[str, Threshold] = Field(default_factory=dict)
    """Conditions on outcomes, by the outcomes' names. A run succeeds if all hold; a missing value
    is a failure.
    """
    stop: Stop | None = None
    """Rule for ending the campaign before all members are flown."""

    @model_validator(mode="before")
    @classmethod
    def _from_plain_data(cls, data):
        return completed(data)

    @model_validator(mode="after")
    def _keys_are_apart(self):
        places = [*self._places()]
        for place, key, _ in places:
            if not _KEY.fullmatch(key):
                raise ValueError(
                    f"{place}: must be a key of the scenario, written like "
                    f"spacecraft.coils.limit_a_m2[0]; received {key!r}"
                )
            if re.split(r"[.\[]", key)[0] in _OWN:
                raise ValueError(f"{place}: must not vary: each member has its own; received {key}")
        for (_, one, changed), (place, other, too) in combinations(places, 2):
            if one == other and changed and too:
                continue
            if _overlap(one, other):
                raise ValueError(f"{place}: must not overlap with another key; received {one}, too")
        tied = sum(each.tied_to is not None for each in self.vary.values())
        if len(self.groups) < len(self.vary) - tied + len(self.correlated):
            raise ValueError("correlated: must not have two tables with the same keys")
        return self

    def _places(self) -> Iterator[tuple[str, str, bool]]:
        """Where keys that vary stand in the table, the keys, and whether they change in turns."""
        for name in ("table", "vary"):
            for key in getattr(self, name):
                yield f'{name}."{key}"', key, False
        for i, together in enumerate(self.correlated):
            for j, key in enumerate(together.keys):
                yield f"correlated[{i}].keys[{j}]", key, together.changes is not None

    @model_validator(mode="after")
    def _attitudes_have_their_key(self):
        for key, variation in self.vary.items():
            if (key == ATTITUDE) != (variation.rotation is not None):
                if key == ATTITUDE:
                    raise ValueError(f'vary."{key}": must be "uniform"; received {variation.form}')
                raise ValueError(
                    f'vary."{key}": must be a table of a variation: only {ATTITUDE} takes '
                    'the word "uniform"; received "uniform"'
                )
        for i, together in enumerate(self.correlated):
            pairs = zip(together.keys, together.changes or (), strict=False)
            for j, (key, change) in enumerate(pairs):
                if (key == ATTITUDE) != (change == "rotation"):
                    raise ValueError(
                        f"correlated[{i}].changes[{j}]: must be 'rotation' for {ATTITUDE}, and for "
                        f"no other key; received {change!r} for {key}"
                    )
                if change == "inertia" and not key.endswith("inertia_kg_m2"):
                    raise ValueError(
                        f"correlated[{i}].changes[{j}]: must be 'inertia' for an inertia_kg_m2 "
                        f"alone; received 'inertia' for {key}"
                    )
        return self

    @model_validator(mode="after")
    def _tied_fit(self):
        for key, variation in self.vary.items():
            if variation.tied_to is None:
                continue
            other = self.vary[variation.tied_to]
            if variation.unit_numbers != other.unit_numbers:
                raise ValueError(
                    f'vary."{key}": must be drawn of {other.unit_numbers} random numbers, as '
                    f"{variation.tied_to}; received one of {variation.unit_numbers}"
                )
            if variation.values and other.values and len(variation.values) != len(other.values):
                raise ValueError(
                    f'vary."{key}".values: must have {len(other.values)} values, as '
                    f"{variation.tied_to}; received {len(variation.values)}"
                )
        return self

    @model_validator(mode="after")
    def _table_has_the_runs(self):
        if self.table:
            check_table(self.table, self.runs, self.sampling)
        return self

    @model_validator(mode="after")
    def _sampling_fits(self):
        if self.sampling == "grid":
            self._check_grid()
        if self.sampling == "saltelli":
            self._check_saltelli()
        numbers = self.runs * self.unit_numbers
        if self.sampling == "latin_hypercube" and numbers > MOST_IN_HYPERCUBE:
            raise ValueError(
                f"sampling: 'latin_hypercube' must have at most {MOST_IN_HYPERCUBE:.0e} numbers in "
                f"all; received {self.runs} runs of {self.unit_numbers}"
            )
        return self

    def _check_grid(self) -> None:
        for key, variation in self.vary.items():
            if variation.values is None:
                raise ValueError(
                    f"vary.\"{key}\": must be given by values with sampling 'grid'; received "
                    f"{variation.form}"
                )
        if self.correlated:
            raise ValueError("correlated: must be left out with sampling 'grid'")
        self._check_no_stop()
        points = math.prod(self.grid)
        if self.runs != points:
            raise ValueError(
                f"runs: must be left out with sampling 'grid', or be its {points} combinations; "
                f"received {self.runs}"
            )

    def _check_no_stop(self) -> None:
        if self.stop is not None:
            raise ValueError(
                f"stop: must be left out with sampling {self.sampling!r}, which must be complete"
            )

    def _check_saltelli(self) -> None:
        if not self.groups:
            raise ValueError("vary: must have a key with sampling 'saltelli'; received none")
        self._check_no_stop()
        if self.runs % self.members_per_point:
            raise ValueError(
                f"runs: must be a multiple of {self.members_per_point}, the members of a point of "
                f"sampling 'saltelli', best with a power of 2 of them; received {self.runs}"
            )

    @model_validator(mode="after")
    def _outcomes_are_known(self):
        for name in self.outcomes:
            if not _NAME.fullmatch(name) or name in _TAKEN:
                raise ValueError(
                    "outcomes: must be named by letters, digits and '_', and not "
                    f"{', '.join(map(repr, _TAKEN))}; received {name!r}"
                )
        known = ", ".join(self.outcomes)
        for name in self.success:
            if name not in self.outcomes:
                raise ValueError(
                    f"success: must be named as outcomes are, {known}; received {name!r}"
                )
        if self.stop is None:
            return self
        if self.stop.outcome == SUCCESS and not self.success:
            raise ValueError("stop.outcome: 'success' needs conditions in success; received none")
        if self.stop.outcome not in (SUCCESS, *self.outcomes):
            raise ValueError(
                f"stop.outcome: must be one of {known}, {SUCCESS}; received {self.stop.outcome!r}"
            )
        return self

    @property
    def varied_keys(self) -> list[str]:
        """Keys of the scenario that vary, in the order of their numbers."""
        keys = (key for together in self.correlated for key in together.keys)
        return [*self.table, *self.vary, *dict.fromkeys(keys)]

    @property
    def rows(self) -> int:
        """How many members there can be: the rows of a table."""
        return min(map(len, self.table.values()), default=MOST_MEMBERS)

    @property
    def in_words(self) -> str:
        """The number of runs, and what varies."""
        keys = self.varied_keys
        varied = f"; varied: {', '.join(keys)}" if keys else ", which differ by their noise only"
        return f"{self.runs} runs, sampling {self.sampling!r}{varied}"

    def _repr_html_(self) -> str:
        """In notebooks: what varies, and what was given as the text of a campaign's table."""
        from torquer.scenario.toml_text import html_of_given

        return f"<p>{escape(self.in_words)}</p>{html_of_given(self, 'campaign')}"

    @property
    def grid(self) -> tuple[int, ...]:
        """Numbers of values by key: the shape of a grid."""
        return tuple(len(variation.values or ()) for variation in self.drawn_alone.values())

    @property
    def drawn_alone(self) -> dict[str, Variation]:
        """The keys of `vary` with a draw of their own, which those tied to them share."""
        return {key: each for key, each in self.vary.items() if each.tied_to is None}

    @property
    def unit_numbers(self) -> int:
        """How many numbers uniform on 0..1 a member is made of."""
        return sum(self.groups.values())

    @property
    def groups(self) -> dict[str, int]:
        """How many of them belong together, by name: a key, or keys that are correlated."""
        single = {key: variation.unit_numbers for key, variation in self.drawn_alone.items()}
        return single | {", ".join(each.keys): each.unit_numbers for each in self.correlated}

    @property
    def members_per_point(self) -> int:
        """Members of a point of Saltelli's design."""
        return len(self.groups) + 2


def _overlap(one: str, other: str) -> bool:
    """Whether keys are the same, or one lies within the other."""
    return any(a[: len(b)] == b or b[: len(a)] == a for a in _changes(one) for b in _changes(other))


def _changes(key: str) -> list[list[str]]:
    """Words of the scenario's keys that a key of a campaign changes."""
    keys = ("initial.quaternion", "initial.euler_deg") if key == ATTITUDE else (key,)
    return [re.findall(r"[^.\[\]]+", key) for key in keys]
