"""A Dask cluster that loses workers or ends: what was flown is kept, one line.

Where `distributed` need not be installed: a module in its place has what torquer asks of it.
"""

import pickle
import sys
import types
from concurrent.futures import Future

import pytest
from slow_cases import slow_after

import torquer
from torquer.campaign import fly
from torquer.campaign.load import campaign_from_data
from torquer.campaign.store import chunks_there
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ADDRESS = "tcp://elsewhere:8786"
TABLE = {
    "runs": 48,
    "vary": {"initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.5, 5.0]}}},
}


class KilledWorker(Exception):
    """Of Dask: a chunk has outlived no worker."""


class Client:
    """Flies chunks at once, but for those at which something happens: `events[first]`."""

    def __init__(self, address, **how):
        if self.absent:
            raise OSError(f"Timed out trying to connect to {address}")
        self.closed = False

    def nthreads(self):
        return {"one": 1, "other": 1}

    def get_executor(self, retries, pure):
        assert retries > 0 and not pure  # Dask itself flies the chunks of a lost worker again
        return self

    def submit(self, function, text, given):
        first = given["first"]
        event, future = self.events.get(first), Future()
        if self.closed or event == "closed":
            self.closed = True
            raise Exception("Tried sending message after closing.  Status: closed\nMessage: {}")
        if event == "killed":
            text = f"Attempted to run task 'chunk-{first}' on 4 different workers"
            future.set_exception(KilledWorker(text))
        elif event == "cancelled":  # as the scheduler has gone
            future.cancel()
            future.set_running_or_notify_cancel()
        elif event == "broken":
            future.set_exception(OSError("in <TCP>: Stream is closed"))
        else:  # as on another machine
            try:
                future.set_result(function(text, pickle.loads(pickle.dumps(given))))
            except Exception as error:
                future.set_exception(error)
        return future

    def close(self):
        if self.events:
            raise self.at_the_end


@pytest.fixture
def cluster(monkeypatch):
    """`cluster(events)`: one at which such things happen."""
    monkeypatch.setattr(fly, "CHUNK", 8)

    def begin(events, at_the_end=TimeoutError, absent=False):
        client = type("Client", (Client,), vars(Client) | {
            "events": events, "at_the_end": at_the_end, "absent": absent,
        })  # fmt: skip
        module = types.SimpleNamespace(Client=client, KilledWorker=KilledWorker)
        monkeypatch.setitem(sys.modules, "distributed", module)

    return begin


@pytest.fixture(scope="module")
def flown(make):
    """A scenario, its campaign and the result of it, flown here."""
    scenario = make()
    made = campaign_from_data(TABLE, scenario)
    return scenario, made, torquer.fly_campaign(scenario, made)


def test_a_cluster_gives_the_same_bits(cluster, flown):
    scenario, made, whole = flown
    cluster({})
    assert torquer.fly_campaign(scenario, made, where=ADDRESS).identical(whole)


@pytest.mark.parametrize("at_the_end", slow_after(1, [TimeoutError, OSError, RuntimeError]))
@pytest.mark.parametrize(
    ("event", "expected"),
    slow_after(
        1,
        [
            ("killed", "KilledWorker: Attempted to run task 'chunk-32' on 4 different workers"),
            ("cancelled", "CancelledError"),
            ("broken", "OSError: in <TCP>: Stream is closed"),
            (
                "closed",
                "Exception: Tried sending message after closing. Status: closed Message: {}",
            ),
        ],
        names=2,
    ),
)
def test_what_was_flown_is_kept(cluster, flown, tmp_path, event, expected, at_the_end):
    scenario, made, whole = flown
    path = tmp_path / "campaign.nc"
    cluster({32: event}, at_the_end)
    with pytest.raises(ValueError, match=r"^where: must keep its scheduler and its") as error:
        torquer.fly_campaign(scenario, made, to=path, where=ADDRESS)
    assert str(error.value).endswith(f"({expected}); what was flown is kept, resume continues")
    assert "\n" not in str(error.value)
    kept = {file: file.read_bytes() for file in chunks_there(path).values()}
    assert len(kept) >= 4  # all that had come back, also those beside the lost one
    cluster({})
    again = torquer.fly_campaign(scenario, made, to=path, where=ADDRESS, resume=True)
    assert again.identical(whole)


def test_a_chunk_that_is_always_lost_is_flown_elsewhere(cluster, flown, tmp_path):
    scenario, made, whole = flown
    path = tmp_path / "campaign.nc"
    cluster({40: "cancelled"})
    for _ in range(3):
        with pytest.raises(ValueError, match=r"^where: must keep"):
            torquer.fly_campaign(scenario, made, to=path, where=ADDRESS, resume=True)
        assert [*chunks_there(path)] == [*range(0, 40, 8)]
    assert torquer.fly_campaign(scenario, made, to=path, resume=True).identical(whole)


def test_an_error_of_our_own_is_none_of_the_cluster(cluster, flown, monkeypatch):
    scenario, made, _ = flown
    cluster({})
    monkeypatch.setattr("torquer.campaign.executors._here", lambda *given: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        torquer.fly_campaign(scenario, made, where=ADDRESS)


def test_a_scheduler_that_is_not_there_is_one_line(cluster, flown):
    scenario, made, _ = flown
    cluster({}, absent=True)
    with pytest.raises(ValueError, match=r"^where: must be the address of a Dask scheduler; rec"):
        torquer.fly_campaign(scenario, made, where=ADDRESS)
