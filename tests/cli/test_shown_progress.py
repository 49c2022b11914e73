"""Long commands show on a terminal that they go on, and are quiet in a pipe."""

import contextlib
import sys

import pytest

LONG = {
    ("design", "three-axis"): "torquer.design.three_axis_gains.three_axis",
    ("design", "magneto-gyro"): "torquer.design.gyro.gains.magneto_gyro",
    ("design", "detumble"): "torquer.design.detumbling.detumble",
    ("design", "mission"): "torquer.design.mission_design.mission",
    ("budget", "--pointing"): "torquer.design.pointing_answer.pointing_budget",
}


class Bars:
    """What takes the place of rich's bars: which are shown."""

    def __init__(self):
        self.shown = []

    def add_task(self, name, *, visible=True, **_):
        self.shown += [name] if visible else []

    def update(self, *_, **__):
        """Nothing moves here."""


@pytest.mark.parametrize("is_cold", [False, True])
@pytest.mark.parametrize("is_terminal", [False, True])
@pytest.mark.parametrize("command", LONG, ids="-".join)
def test_long_designs_show_progress_on_a_terminal_alone(
    monkeypatch, call, scenario, tmp_path, command, is_terminal, is_cold
):
    bars, during = Bars(), []

    @contextlib.contextmanager
    def shown(*columns):
        assert not bars.shown, "rich shows one display at a time"
        yield bars
        bars.shown.clear()

    def work(*_):
        during.extend(bars.shown)
        raise ValueError("key: must end here")

    for place in ("output", "compiling"):
        monkeypatch.setattr(f"torquer.cli.{place}.progress_bar", shown)
    monkeypatch.setattr("torquer.cli.compiling.is_cold", lambda: is_cold)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal, raising=False)
    monkeypatch.setattr(LONG[command], work)
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*command[:2], scenario)
    assert (code, out) == (2, "") and err.endswith("error: key: must end here\n")
    assert bool(during) == is_terminal
