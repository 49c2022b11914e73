"""Distributions of the user's own: a member's random numbers go in, its value comes out.

[campaign.vary]
initial.rate_deg_s = { own = { file = "tip_off.py", function = "rates", draws = 3 } }
"""

from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import Field

from torquer.base.user_code import UserCode
from torquer.base.user_source import error_line, printable

#: Stands for the member in what a function is refused for.
_MEMBER = "{member}"
#: Most random numbers of a member's value.
_MOST_DRAWS = 1000


class RefusedDraw(ValueError):
    """A value that a function must not return; `row`: of the numbers that it was given, -1 for
    those in the middle, 0.5."""

    def __init__(self, refusal: ValueError, row: int):
        super().__init__(str(refusal))
        self.row = row

    def of(self, members) -> ValueError:
        """The same with the member that it is of, by the numbers of all."""
        member = "u = 0.5" if self.row < 0 else f"member {members[self.row]}"
        return ValueError(str(self).replace(_MEMBER, member))


class OwnDraws(UserCode):
    """A distribution of your own: a function `(u, **parameters)` in a Python file.

    It gets the random numbers (draws,) of one member, each uniform between 0 and 1, and returns the
    member's value: a number, a vector or a matrix of numbers. It must take nothing else that is
    random: the same numbers give the same value.
    """

    place: ClassVar = "campaign.vary"
    takes: ClassVar = 1
    returns: ClassVar = "a function (u) that returns a finite number, vector or matrix"

    draws: int = Field(default=1, ge=1, le=_MOST_DRAWS)
    """How many random numbers a member's value is made of."""

    def values(self, units: np.ndarray) -> np.ndarray:
        """Values [n, ...] of random numbers [n, draws]; RefusedDraw for one that is none.

        Each is asked for alone: it does not depend on what is asked for together.
        """
        function = self.load()
        shape = self._value(function, np.full(self.draws, 0.5), -1).shape
        found = np.empty((len(units), *shape))
        for row, u in enumerate(units):
            value = self._value(function, u, row)
            if value.shape != shape:
                raise self._refused(f"shape {value.shape}, not {shape} as for u = 0.5,", row)
            found[row] = value
        return found

    def check_repeats(self, units: np.ndarray) -> None:
        """RefusedDraw if the same random numbers [n, draws] give other values."""
        both = zip(self.values(units), self.values(units), strict=True)
        for row, (one, other) in enumerate(both):
            if not np.array_equal(one, other):
                received = f"{one.tolist()}, then {other.tolist()}"
                raise self._refused(received, row, ", the same for the same u")

    def _value(self, function, u: np.ndarray, row: int) -> np.ndarray:
        try:
            given = function(u.copy())
        except (Exception, SystemExit) as error:
            line = error_line(error, Path(self.plain().__code__.co_filename))
            raise self._refused(printable(error), row, line=line) from None
        try:
            value = self.numbers(given)
        except ValueError:
            raise self._refused(printable(given), row) from None
        if value.ndim > 2 or not value.size:
            raise self._refused(f"shape {value.shape}", row)
        if not np.isfinite(value).all():
            raise self._refused(str(value.tolist()), row)
        return value

    def _refused(self, received: str, row: int, more: str = "", line: int = 0) -> RefusedDraw:
        return RefusedDraw(self.refusal(f"{received} for {_MEMBER}", more, line), row)
