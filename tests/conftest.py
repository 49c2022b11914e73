"""One plain scenario for the tests of whole runs, changed by dotted keys."""

import copy
import gc
import os
import signal

import pytest

# Before NumPy is loaded: its threads wait by spinning, while other workers need the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["TORQUER_LANG"] = "en"  # texts are compared, whatever the locale

from torquer.scenario.load import scenario_from_data

PLAIN = {
    "start": "2012-03-04T10:31:47Z",
    "orbit": {"kind": "circular", "altitude_km": 550.0, "inclination_deg": 60.0},
    "environment": {"field": {"kind": "averaged"}, "earth_rotation": "sidereal"},
    "spacecraft": {
        "body": {"inertia_kg_m2": [[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]]},
        "coils": {"limit_a_m2": 3.0},
    },
    "initial": {"rate_deg_s": [1.0, -0.6, 0.8], "euler_deg": [20.0, -35.0, 70.0]},
    "control": {"law": {"kind": "off"}},
    "simulation": {"duration_s": 600.0, "step_s": 1.0, "record_s": 10.0},
}


def pytest_configure():
    """Let Ctrl-C interrupt: what a shell starts in the background is born ignoring it.

    And search objects for garbage less often, the modules and tests that stay never.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    gc.set_threshold(50_000, 10, 100)


def pytest_collection_finish():
    """Take what stays, modules and tests, out of all further searches: 670 000 objects."""
    gc.freeze()


@pytest.hookimpl(optionalhook=True, wrapper=True)
def pytest_xdist_auto_num_workers():
    """One worker more than there are cores: see `waiting_aside`."""
    return (yield) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """The order in which `--dist loadfile` gives files to workers."""
    if config.getvalue("dist") == "loadfile":
        from waiting_aside import WaitingAside

        return WaitingAside(config, log)
    return None


def changed(data: dict, changes: dict) -> dict:
    """A deep copy with values set (or, for None, removed) at dotted keys."""
    data = copy.deepcopy(data)
    for dotted, value in changes.items():
        *tables, key = dotted.split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            del table[key]
        else:
            table[key] = copy.deepcopy(value)
    return data


@pytest.fixture(scope="session")
def plain_data():
    """`plain_data({"simulation.step_s": 0.5})`: the plain scenario as data, changed."""
    return lambda changes=(): changed(PLAIN, dict(changes))


@pytest.fixture(scope="session")
def make():
    """`make({"simulation.step_s": 0.5})`: the plain scenario, changed."""
    return lambda changes=(): scenario_from_data(changed(PLAIN, dict(changes)))
