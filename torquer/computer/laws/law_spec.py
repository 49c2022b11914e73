"""A law as users state it: its keys, from which the law is made."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from torquer.base.computing import by_scenario
from torquer.base.spec import Spec
from torquer.computer.blocks.law import Law
from torquer.computer.laws.held import Attitude


class LawSpec(Spec):
    """A law of a scenario; see `Law` for what its kernel is handed, needs and answers with."""

    kernel: ClassVar[Callable]
    memory: ClassVar[Mapping | tuple] = ()
    log: ClassVar[Mapping[str, str]] = {}
    needs: ClassVar[frozenset[str]] = frozenset()
    #: What of `needs` may read no number: the kernel itself does without.
    bears: ClassVar[frozenset[str]] = frozenset()
    answers: ClassVar[str] = "dipole"
    states: ClassVar[str | None] = None
    #: Parameters that follow from the scenario, of `OF_SATELLITE`; no command sets them.
    satellite: ClassVar[tuple[str, ...]] = ()
    #: Key of the momentum that the law wants the wheels to have; of its axis, where it is a number.
    momentum_key: ClassVar[str] = ""
    momentum_axis_key: ClassVar[str] = ""
    #: What it logs of the attitude that it steers on the way to the one that it holds.
    steers: ClassVar[str] = ""

    def parameters(self) -> Any:
        """What the kernel takes of the keys, in SI units."""
        return ()

    def held(self) -> Attitude | None:
        """The attitude that the law holds; None for one that holds none."""
        return None

    def law(self) -> Law:
        """The law with these keys."""
        cls = type(self)  # an instance would bind the kernel as a method
        parameters = by_scenario(cls.parameters)(self)
        return Law(
            self.kind, cls.kernel, parameters, self.memory, self.log, self.needs,
            spec=self, answers=self.answers, states=self.states,
            waits_for=self.needs - self.bears, satellite=self.satellite,
            fixed=frozenset(self.satellite),
        )  # fmt: skip
