"""CDH, command and data handling: keeps an eye on the queues.

After SDOT App. A. The queues themselves are `torquer.flight.software.queues`.
"""

from __future__ import annotations

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module

#: Queues that belong to no module, in the order of the packet `queues`.
SHARED = ("acks", "ground", "state")


class CdhSettings(Spec):
    """Settings of command and data handling."""

    report_s: float = Field(default=600.0, ge=0.0)
    """Time between two packets on the queues; 0: none."""


class CdhModule(Module):
    """Tells the ground what the queues hold, and when one has dropped an element."""

    name = "cdh"
    Settings = CdhSettings
    period_s = 10.0

    def __init__(self, settings: CdhSettings):
        super().__init__(settings)
        self.dropped: dict[str, int] = {}
        self.due_s = 0.0

    def start(self, core) -> None:
        """The first packet comes after the first period."""
        self.due_s = core.t_s + self.settings.report_s

    def step(self, core) -> None:
        """Events for queues that dropped elements, state vectors apart, which are meant to be.

        Each doubling is one: a queue that nobody empties is not to drown the log.
        """
        dropped = core.cdh.dropped
        for number, queue in enumerate(dropped):
            if queue == "state":
                continue
            before, self.dropped[queue] = self.dropped.get(queue, 0), dropped[queue]
            if dropped[queue].bit_length() > before.bit_length():
                core.report("cdh", Reason.QUEUE_FULL, number)
        if core.t_s >= self.due_s and self.settings.report_s:
            self.due_s = core.t_s + self.settings.report_s
            core.send("queues", contents(core.cdh))

    def status(self) -> dict[str, float]:
        """Elements that were dropped, by queue."""
        return dict(self.dropped)


def contents(cdh) -> tuple[int, ...]:
    """Values of the packet `queues`: what waits, then what was dropped; commands of all modules."""
    waiting = {queue: len(elements) for queue, elements in cdh.queues.items()}
    rows = []
    for count in (waiting, cdh.dropped):
        commands = sum(n for queue, n in count.items() if queue not in SHARED)
        rows += [commands, *(count[queue] for queue in SHARED)]
    return tuple(rows)
