"""The last of three workers runs the files that wait, and every test is run once."""

from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("xdist")
from waiting_aside import DEAR, WAITING, WaitingAside

NAMES = ("a.py", "pages/b.py", *(f"base/{k}.py" for k in range(8)), "pages/c.py")
TESTS = [f"tests/{name}::test_{k}" for name in NAMES for k in range(4)]


class Worker:
    """Runs what it is given when it is asked to; as a worker of xdist does, all but the last two
    tests, and those when it is to end."""

    def __init__(self, name):
        self.gateway, self.shutting_down = SimpleNamespace(id=name), False
        self.given, self.ran = [], []

    def send_runtest_some(self, places):
        self.given += places

    def shutdown(self):
        self.shutting_down = True


def run(count, tests=TESTS):
    """The tests that each of so many workers ran."""
    config = SimpleNamespace(
        getvalue=lambda name: ["popen"] * count, option=SimpleNamespace(loadscopereorder=True)
    )
    scheduler = WaitingAside(config)
    workers = [Worker(f"gw{k}") for k in range(count)]
    for worker in workers:
        scheduler.add_node(worker)
    for worker in workers:
        scheduler.add_node_collection(worker, tests)
    scheduler.schedule()
    while moved := [w for w in workers if len(w.given) > (0 if w.shutting_down else 1)]:
        for worker in moved:
            place = worker.given.pop(0)
            worker.ran.append(tests[place])
            scheduler.mark_test_complete(worker, place)
    assert all(worker.shutting_down for worker in workers) and not scheduler.has_pending
    assert sorted(test for worker in workers for test in worker.ran) == sorted(tests)
    return [worker.ran for worker in workers]


def test_the_last_of_three_waits_for_the_others():
    *others, aside = run(3)
    assert {test.startswith(WAITING) for test in aside} == {True} and len(aside) == 8
    assert all(len(ran) > 0 for ran in others)


@pytest.mark.parametrize("count", [1, 2])
def test_of_fewer_each_runs_what_comes(count):
    assert all(run(count))


def test_without_files_that_wait_or_with_nothing_else_all_is_run():
    run(3, [test for test in TESTS if not test.startswith(WAITING)])
    run(3, [test for test in TESTS if test.startswith(WAITING)])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_dearest_files_are_begun_first(count):
    dear = [f"{file}::test" for file in reversed(DEAR)]
    ran = run(count, [*TESTS, *dear])
    at_work = ran[: 2 if count == 3 else count]
    firsts = {worker[0] for worker in at_work}
    assert firsts == {f"{file}::test" for file in DEAR[: len(at_work)]}
    for worker in at_work:
        others = [test for test in worker if not test.startswith(WAITING)]
        assert [test in dear for test in others] == sorted(
            (t in dear for t in others), reverse=True
        )


def test_the_dear_files_are_there():
    root = Path(__file__).parents[1]
    assert [file for file in DEAR if not (root / file).is_file()] == []
