"""What a law holds, as data: the one declaration from which all that is said of errors follows."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # it is what laws without targets need not import
    from torquer.computer.laws.targets import Targets

ORBITAL, INERTIAL, OF_TARGETS = "orbital", "inertial", "of targets"


class Attitude(NamedTuple):
    """An attitude of the body to the orbital frame, or else to the inertial one; or, with
    `targets`, the one that these give at each instant.

    `steered_in`: variable of results that has the attitude which the law steers meanwhile, along a
    slew; "" for a law that turns at once to what it holds.
    """

    orbital: bool
    q_wanted: tuple[float, ...]
    targets: Targets | tuple[()] = ()
    steered_in: str = ""

    @property
    def frame(self) -> str:
        """The frame in which it is at rest, in a word; of targets, their own."""
        if self.targets:
            return OF_TARGETS
        return ORBITAL if self.orbital else INERTIAL

    def with_parameter(self, name: str, value) -> Attitude:
        """What is held after a state of the modes has set a parameter of the law."""
        if self.targets:
            return self._replace(targets=self.targets.with_parameter(name, value))
        if name == "q_wanted" and isinstance(value, tuple):
            return self._replace(q_wanted=value)
        return self
