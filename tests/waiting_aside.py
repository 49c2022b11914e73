"""Which worker runs which file of tests: those that mostly wait have one beside the others.

Tests of pages wait for browsers and servers, two thirds of their time. A worker for each core and
one more for them leaves no core idle meanwhile.
"""

from xdist.scheduler import LoadFileScheduling

#: Where the tests are that mostly wait.
WAITING = "tests/pages/"


class WaitingAside(LoadFileScheduling):
    """Files go to workers as `--dist loadfile` has it, but of three or more the last is given those
    that wait, and ends when there are no more; the others take of them when nothing else is left.
    """

    def _is_aside(self, node) -> bool:
        return (
            len(self.registered_collections) > 2 and node is list(self.registered_collections)[-1]
        )

    def _first(self, waiting: bool) -> str | None:
        """The next file that waits, or does not."""
        return next((each for each in self.workqueue if each.startswith(WAITING) is waiting), None)

    def _assign_work_unit(self, node) -> None:
        if chosen := self._first(self._is_aside(node)):
            self.workqueue.move_to_end(chosen, last=False)
        super()._assign_work_unit(node)

    def _reschedule(self, node) -> None:
        if self._is_aside(node) and not self._first(True) and not node.shutting_down:
            node.shutdown()  # what it was given it still runs
            return
        super()._reschedule(node)
