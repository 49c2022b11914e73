"""Which worker runs which file of tests, and when: the dearest begin, so that no core is left idle
while another one runs a long file at the end; those that mostly wait have a worker of their own.

Tests of pages wait for browsers and servers, two thirds of their time. A worker for each core and
one more for them leaves no core idle meanwhile.
"""

from xdist.scheduler import LoadFileScheduling

#: Where the tests are that mostly wait.
WAITING = "tests/pages/"
#: Files that take more than 25 s of processor time where nothing is compiled, the dearest first.
DEAR = (
    "tests/test_tutorials.py",
    "tests/computer/estimation/test_hypotheses.py",
    "tests/cli/test_design_magneto_gyro_command.py",
    "tests/ground/telemetry/test_attitude.py",
    "tests/campaign/test_parts.py",
    "tests/computer/laws/test_magneto_gyro_flights.py",
    "tests/simulation/test_own_keys.py",
    "tests/spacecraft/wheel_array/test_steering.py",
    "tests/campaign/test_momenta.py",
    "tests/reliability/test_cache.py",
    "tests/theory/slow/test_averaging.py",
)


def cost_rank(file: str) -> int:
    """Place of a file in the order of cost; all that is not dear has the last."""
    return DEAR.index(file) if file in DEAR else len(DEAR)


class WaitingAside(LoadFileScheduling):
    """Files go to workers as `--dist loadfile` has it, but of three or more the last is given those
    that wait, and ends when there are no more; the others take of them when nothing else is left.
    """

    def _is_aside(self, node) -> bool:
        return (
            len(self.registered_collections) > 2 and node is list(self.registered_collections)[-1]
        )

    def _first(self, waiting: bool) -> str | None:
        """The next file that waits, or does not: the dearest, else as it comes."""
        fitting = [each for each in self.workqueue if each.startswith(WAITING) is waiting]
        return min(fitting, key=cost_rank, default=None)

    def _assign_work_unit(self, node) -> None:
        if chosen := self._first(self._is_aside(node)):
            self.workqueue.move_to_end(chosen, last=False)
        super()._assign_work_unit(node)

    def _reschedule(self, node) -> None:
        if self._is_aside(node) and not self._first(True) and not node.shutting_down:
            node.shutdown()  # what it was given it still runs
            return
        super()._reschedule(node)
