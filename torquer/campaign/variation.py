"""Variations: how a value of a scenario differs from member to member of a campaign.

[campaign.vary]
orbit.raan_deg = { uniform = [0, 360] }
spacecraft.magnetometer.bias_nt = { normal = { mean = [0, 0, 0], sigma = 50 } }
spacecraft.body.inertia_kg_m2 = { relative = { truncated_normal = { mean = 1, sigma = 0.05,
low = 0.9, high = 1.1 } } }
initial.rate_deg_s = { direction = "uniform", magnitude = { uniform = [0, 10] } }
initial.attitude = "uniform"
"""

import sys
from collections.abc import Mapping
from datetime import date, datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from torquer.base import validate
from torquer.base.spec import Spec
from torquer.base.time import parse_utc
from torquer.campaign.changes import CHANGES
from torquer.campaign.own_draws import OwnDraws

#: The key under which attitudes vary on the whole rotation group.
ATTITUDE = "initial.attitude"
#: A number of any size: its range is that of the scenario's key. (The explicit bound replaces the
#: range that specs give to a number by its name.)
Number = Annotated[float, Field(le=sys.float_info.max)]
#: A number, or a vector of numbers.
Size = Number | tuple[Number, ...]
_NotNegative = Annotated[float, Field(ge=0.0, le=sys.float_info.max)]
#: Negative eigenvalues of a covariance, and its asymmetry, that are rounding: relative to the
#: greatest entry.
_ROUNDING = 1e-9


def _bounds(key: str, value):
    """(low, high) of numbers or vectors of equal length."""
    low, high = (validate.finite(key, bound) for bound in value)
    if low.shape != high.shape or low.ndim > 1 or not low.size:
        raise ValueError(
            f"{key}: must have two numbers or two vectors of equal length; received {value!r}"
        )
    _check_order(key, bool(np.all(low <= high)), value)
    return as_numbers(low), as_numbers(high)


def _check_two(key: str, value) -> None:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError(f"{key}: must be a list of two, [low, high]; received {value!r}")


def _check_order(key: str, ordered: bool, value) -> None:
    if not ordered:
        raise ValueError(f"{key}: must have the lower bound first; received {value!r}")


def as_numbers(values: np.ndarray):
    """Plain data of an array: a number, or tuples however deep."""
    return _as_tuples(values.tolist())


def _as_tuples(plain):
    return tuple(map(_as_tuples, plain)) if isinstance(plain, list) else plain


def _uniform_bounds(value):
    """(low, high) of numbers, of vectors of equal length, or of times."""
    _check_two("uniform", value)
    if not any(isinstance(bound, str | date) for bound in value):
        return _bounds("uniform", value)
    low, high = (parse_utc(bound, "uniform") for bound in value)
    _check_order("uniform", low <= high, value)
    return low, high


def _positive_bounds(value):
    """(low, high) of positive numbers or vectors of them."""
    _check_two("log_uniform", value)
    low, high = _bounds("log_uniform", value)
    if not np.all(np.array(low) > 0.0):
        raise ValueError(f"log_uniform: must have bounds above 0; received {value!r}")
    return low, high


def _quantile_table(value):
    """Pairs (share, value) that rise from the share 0 to 1."""
    pairs = validate.finite("quantiles", value)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) < 2:
        raise ValueError(
            f"quantiles: must be pairs [share, value], two or more; received {value!r}"
        )
    shares, values = pairs.T
    if not (shares[0] == 0.0 and shares[-1] == 1.0 and np.all(np.diff(shares) > 0.0)):
        raise ValueError(
            f"quantiles: must have shares that rise from 0 to 1; received {shares.tolist()}"
        )
    if np.any(np.diff(values) < 0.0):
        raise ValueError(
            f"quantiles: must have values that do not fall; received {values.tolist()}"
        )
    return as_numbers(pairs)


class Normal(Spec):
    """A normal distribution, of each component independently if one of the two is a vector."""

    mean: Size
    """Mean, a number or a vector."""
    sigma: _NotNegative | tuple[_NotNegative, ...]
    """Standard deviation, one number or one per component."""

    @model_validator(mode="after")
    def _lengths_fit(self):
        common_length(mean=self.mean, sigma=self.sigma)
        return self


class TruncatedNormal(Spec):
    """A normal distribution within bounds, of which one may be left out."""

    mean: Size
    """Mean before truncation."""
    sigma: Annotated[float, Field(gt=0.0, le=sys.float_info.max)]
    """Standard deviation before truncation."""
    low: Size | None = None
    """Lower bound; left out: none."""
    high: Size | None = None
    """Upper bound; left out: none."""

    @model_validator(mode="after")
    def _bounds_fit(self):
        given = {key: getattr(self, key) for key in ("low", "high")}
        given = {key: bound for key, bound in given.items() if bound is not None}
        if not given:
            raise ValueError("low, high: one of the two or both must be given; received none")
        common_length(mean=self.mean, **given)
        if len(given) == 2 and not np.all(np.array(self.low) < np.array(self.high)):
            raise ValueError(f"low: must be below high, {self.high}; received {self.low}")
        return self


def common_length(**sizes) -> int | None:
    """Length of the vectors among sizes, None if all are numbers; ValueError if they differ."""
    lengths = {key: len(size) for key, size in sizes.items() if isinstance(size, tuple)}
    for key, length in lengths.items():
        if length == 0 or length != next(iter(lengths.values())):
            text = f"vectors of {' and '.join(map(str, lengths.values()))} numbers"
            raise ValueError(f"{key}: must be a number, or as long as the others; received {text}")
    return next(iter(lengths.values()), None)


def _as_variation(value):
    """A plain number as the variation that always has this value."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"values": [value]} if is_number else value


class Variation(Spec):
    """How the value of a key varies; one of these keys is given (`magnitude` with `direction`).

    The word "uniform" alone stands for `rotation = "uniform"`.
    """

    values: tuple[Any, ...] | None = Field(default=None, min_length=1)
    """A list of values, each drawn with equal probability."""
    uniform: Annotated[Any, AfterValidator(_uniform_bounds)] = None
    """[low, high] of a uniform distribution: numbers, vectors (component by component) or two
    times.
    """
    log_uniform: Annotated[Any, AfterValidator(_positive_bounds)] = None
    """[low, high] of a distribution whose logarithm is uniform; both positive."""
    normal: Normal | None = None
    """A normal distribution."""
    truncated_normal: TruncatedNormal | None = None
    """A normal distribution within bounds."""
    quantiles: Annotated[Any, AfterValidator(_quantile_table)] = None
    """A distribution of your own, of a number: pairs [share of the members, value that they do not
    exceed] with rising shares from 0 to 1, between which the value goes in a straight line.
    """
    own: OwnDraws | None = None
    """A distribution of your own, of a number, a vector or a matrix: a function in a Python file.
    """
    direction: Literal["uniform"] | None = None
    """A vector of isotropic direction, whose length is the `magnitude`."""
    magnitude: Annotated["Variation | None", BeforeValidator(_as_variation)] = None
    """Length of the vector of `direction`: a number or a variation of one."""
    relative: "Variation | None" = None
    """A variation of the factor by which the scenario's own value is multiplied."""
    rotation: Literal["uniform"] | None = None
    """An attitude, uniformly distributed over all rotations."""
    tied_to: str | None = None
    """Another key that varies, whose draw this one shares: both are high or low together, and of
    lists they have the values at the same place. Alone it also stands for the other key's
    variation: the same value, or the same factor with `relative`.
    """

    @model_validator(mode="before")
    @classmethod
    def _word_is_a_rotation(cls, data):
        if isinstance(data, str):
            return {"rotation": data}
        if isinstance(data, Mapping):  # what is stored holds the forms that are not given, too
            return {key: value for key, value in data.items() if value is not None}
        return data

    @model_validator(mode="after")
    def _one_form(self):
        given = [form for form in FORMS if getattr(self, form) is not None]
        if len(given) != 1:
            received = " and ".join(given) or "none"
            raise ValueError(f"must have one of {', '.join(FORMS)}; received {received}")
        if (self.direction is None) != (self.magnitude is None):
            missing = "direction" if self.direction is None else "magnitude"
            raise ValueError(f"{missing}: must be given for a vector; received none")
        for key in ("magnitude", "relative"):
            part = getattr(self, key)
            if part is not None and part.tied_to is not None:
                raise ValueError(f"{key}.tied_to: must stand beside it; received it within")
            if part is not None and not part.is_of_a_number:
                raise ValueError(f"{key}: must vary a single number; received {part.in_words}")
        return self

    @property
    def form(self) -> str:
        """Name of the form that is given."""
        return next(form for form in FORMS if getattr(self, form) is not None)

    @property
    def length(self) -> int | None:
        """Length of a vector; None for what is a number or no numbers at all."""
        if self.form in ("uniform", "log_uniform"):
            low, high = getattr(self, self.form)
            return common_length(low=low, high=high)
        if self.normal is not None:
            return common_length(mean=self.normal.mean, sigma=self.normal.sigma)
        if (cut := self.truncated_normal) is not None:
            return common_length(mean=cut.mean, low=cut.low, high=cut.high)
        return {"direction": 3, "rotation": 4}.get(self.form)

    @property
    def own_draws(self) -> OwnDraws | None:
        """The function of the user's own by which it draws, or what is within it."""
        within = self.magnitude or self.relative
        return within.own_draws if within else self.own

    @property
    def is_of_times(self) -> bool:
        """Whether it varies a time."""
        return self.uniform is not None and isinstance(self.uniform[0], datetime)

    @property
    def is_of_a_number(self) -> bool:
        """Whether it varies a single number by itself."""
        if self.values is not None:
            return all(isinstance(_as_variation(value), dict) for value in self.values)
        return self.length is None and self.relative is None and not self.is_of_times

    @property
    def is_bounded(self) -> bool:
        """Whether every value lies between ends that can be drawn."""
        if self.truncated_normal is not None:
            return None not in (self.truncated_normal.low, self.truncated_normal.high)
        within = self.magnitude or self.relative
        return within.is_bounded if within else self.normal is None

    @property
    def unit_numbers(self) -> int:
        """How many numbers uniform on 0..1 a value is made of."""
        if self.direction is not None:
            return 2 + self.magnitude.unit_numbers
        if self.relative is not None:
            return self.relative.unit_numbers
        if self.own is not None:
            return self.own.draws
        return 3 if self.rotation else self.length or 1

    @property
    def in_words(self) -> str:
        """What it varies."""
        if self.values is not None:
            return "values that are not numbers"
        return {"relative": "another factor", "rotation": "an attitude"}.get(
            self.form, "times" if self.is_of_times else "a vector"
        )


#: Forms of a variation.
FORMS = tuple(name for name in Variation.model_fields if name not in ("magnitude", "tied_to"))


class Correlated(Spec):
    """Keys with a joint normal distribution: of their values, or of changes to those of the file.

    One of `mean` and `changes` is given. Tables with `changes` may share keys: a later one changes
    what those before it have drawn.
    """

    keys: tuple[str, ...] = Field(min_length=1)
    """Keys of the scenario, with `mean` each of a single number."""
    mean: tuple[Number, ...] | None = None
    """Means, in the order of the keys."""
    changes: tuple[Literal["number", "vector", "factor", "rotation", "inertia"], ...] | None = None
    """What the scenario's values are changed by, in the order of the keys. A 'number' or the three
    of a 'vector' are added. For a 'factor' it is the logarithm, for a 'rotation' of
    "initial.attitude" the three angles in the body [rad]. For an 'inertia' it is the six elements
    xx, yy, zz, xy, xz, yz, added as far as a body can have them.
    """
    covariance: tuple[tuple[Number, ...], ...]
    """Covariance matrix in the order of the keys, with `changes` of all their numbers; symmetric
    and without negative eigenvalues.
    """

    @model_validator(mode="after")
    def _is_a_distribution(self):
        if (self.mean is None) == (self.changes is None):
            received = "none" if self.mean is None else "both"
            raise ValueError(f"mean, changes: one of the two must be given; received {received}")
        name = "mean" if self.changes is None else "changes"
        given = len(getattr(self, name))
        if given != len(self.keys):
            what = "a number" if self.changes is None else "a word"
            raise ValueError(
                f"{name}: must have {what} for each of {len(self.keys)} keys; received {given}"
            )
        count = self.unit_numbers
        if [len(row) for row in self.covariance] != [count] * count:
            shown = [list(row) for row in self.covariance]
            raise ValueError(f"covariance: must be {count} rows of {count}; received {shown}")
        covariance = np.array(self.covariance)
        rounding = _ROUNDING * np.abs(covariance).max()
        if np.abs(covariance - covariance.T).max() > rounding:
            raise ValueError(f"covariance: must be symmetric; received {covariance.tolist()}")
        least = np.linalg.eigvalsh(covariance)[0]
        if least < -rounding:
            raise ValueError(
                "covariance: must be positive semidefinite; received one with the eigenvalue "
                f"{least:.6g}"
            )
        return self

    @property
    def unit_numbers(self) -> int:
        """How many numbers uniform on 0..1 its values are made of."""
        if self.changes is None:
            return len(self.keys)
        return sum(CHANGES[change].numbers for change in self.changes)

    def root(self) -> np.ndarray:
        """The symmetric square root of the covariance.

        Unlike eigenvectors or a factor of a semidefinite matrix it is unique: members are the
        same on every processor, up to rounding. Of eigenvalues that are rounding the square roots
        would not be small: these are 0.
        """
        values, vectors = np.linalg.eigh(np.array(self.covariance))
        values[values < len(values) * np.finfo(float).eps * values[-1]] = 0.0
        return (vectors * np.sqrt(values)) @ vectors.T
