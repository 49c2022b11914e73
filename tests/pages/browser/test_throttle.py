"""One line a cause at once, and then seldom, with counts."""

from torquer.pages.browser.throttle import MOST_CAUSES, PAUSES_S, Throttle


class Bench:
    def __init__(self):
        self.said, self.now_s = [], 0.0
        self.throttle = Throttle(self.said.append, lambda: self.now_s)


def test_the_first_of_each_cause_is_said_at_once():
    bench = Bench()
    for cause in ("a", "b", "a"):
        bench.throttle.note(cause, "what")
    assert bench.said == ["a (what)", "b (what)"]


def test_what_goes_on_is_said_ever_more_seldom_and_nothing_is_lost():
    bench = Bench()
    for k in range(100_000):
        bench.now_s = k * 0.01
        bench.throttle.note("a")
    bench.now_s += PAUSES_S[1]
    bench.throttle.flush()
    assert len(bench.said) < 30
    counts = [int(line.split()[2]) + 1 if "more" in line else 1 for line in bench.said]
    assert sum(counts) == 100_000


def test_what_is_over_is_forgotten_and_said_at_once_when_it_comes_again():
    bench = Bench()
    for _ in range(3):
        bench.throttle.note("a")
        bench.now_s += 1000.0
        bench.throttle.flush()
    assert bench.said == ["a"] * 3


def test_causes_are_bounded():
    bench = Bench()
    for k in range(10_000):
        bench.throttle.note(f"cause {k}")
    assert len(bench.said) == MOST_CAUSES + 1 and bench.said[-1] == "others"
