"""A campaign of tip-offs against the other ways to fly many, on two workers: microseconds of wall
time for a member's second, preparation included.

.venv/bin/python benchmarks/campaign_peers.py    (Basilisk only where `bsk` is installed)

Not the same work: see `basilisk_peer` for what Basilisk leaves out and adds. Nothing is recorded
by the C++ program, by SciPy and by Basilisk; torquer keeps every member's rate once a minute.
"""

import importlib.util
import json
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from basilisk_peer import assembled
from cpp_peer import CppPeer
from detumble_task import Task, read_coefficients
from scipy_loop import run as run_scipy
from torquer_side import scenario_of

import torquer
from torquer.campaign.load import campaign_from_data

WORKERS = 2
ROUNDS = 3
TASK = Task()
#: Members, and seconds of each where not the whole task: as many as take seconds.
TORQUER, CPP, SCIPY, BASILISK = (1024, None), (32, None), (8, 60), (8, None)
CAMPAIGN = {
    "seed": 1,
    "vary": {"initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.0, 15.0]}}},
    "outcomes": {"settling_s": {"signal": "rate_deg_s", "what": {"settles_below": 0.5}}},
}


def rates_rad_s(members: int) -> np.ndarray:
    """First rates about each axis for the ways that vary the size only."""
    return np.radians(np.linspace(0.5, 8.0, members))


def by_torquer(members: int, _) -> None:
    """A campaign with its report of outcomes, on threads."""
    scenario = scenario_of(TASK).replace("simulation.record_s", 60.0)
    campaign = campaign_from_data({**CAMPAIGN, "runs": members}, scenario)
    torquer.fly_campaign(scenario, campaign, workers=WORKERS)


def by_cpp(members: int, _) -> None:
    """The C++ program with the environment shared by the stages of a step, on threads."""
    peer = CppPeer(*read_coefficients())
    tasks = [replace(TASK, rate_rad_s=rate) for rate in rates_rad_s(members)]
    with ThreadPoolExecutor(WORKERS) as threads:
        list(threads.map(peer.run_shared, tasks))


def _scipy_member(rate_rad_s: float, seconds: int) -> np.ndarray:
    return run_scipy(replace(TASK, rate_rad_s=rate_rad_s), *read_coefficients(), seconds)[0]


def by_scipy(members: int, seconds: int) -> None:
    """`solve_ivp` over each second, on processes."""
    with ProcessPoolExecutor(WORKERS) as processes:
        list(processes.map(_scipy_member, rates_rad_s(members), [seconds] * members))


def basilisk_member():
    """Basilisk's creation function."""
    return assembled(TASK, "bdot")


def fly_basilisk(simulation) -> None:
    """Basilisk's execution function."""
    from Basilisk.utilities import macros

    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(float(TASK.n_steps)))
    simulation.ExecuteSimulation()


def by_basilisk(members: int, _) -> None:
    """Basilisk's own Monte Carlo, on processes, without retention (it would add a second a run)."""
    from Basilisk.utilities.MonteCarlo.Controller import Controller
    from Basilisk.utilities.MonteCarlo.Dispersions import UniformVectorDispersion

    controller = Controller()
    controller.setSimulationFunction(basilisk_member)
    controller.setExecutionFunction(fly_basilisk)
    controller.setExecutionCount(members)
    controller.setThreadCount(WORKERS)
    controller.setVerbose(False)
    controller.setShowProgressBar(False)
    bounds = [0.0, float(np.radians(8.0))]
    controller.addDispersion(UniformVectorDispersion("body.hub.omega_BN_BInit", bounds))
    failed = controller.executeSimulations()
    assert not failed, f"Basilisk: runs {failed} failed"


def us_a_second(fly: Callable, size: tuple[int, int | None]) -> float:
    """Wall time of a member's second [us]: the best of some rounds."""
    members, seconds = size
    best = float("inf")
    for _ in range(ROUNDS):
        begun_s = time.perf_counter()
        fly(members, seconds)
        best = min(best, time.perf_counter() - begun_s)
    return 1e6 * best / members / (seconds or TASK.n_steps)


def main() -> None:
    """Print what each way costs, and how often that is what torquer takes."""
    ways = {"torquer": (by_torquer, TORQUER), "c++": (by_cpp, CPP), "scipy": (by_scipy, SCIPY)}
    if importlib.util.find_spec("Basilisk") is not None:
        ways["basilisk"] = (by_basilisk, BASILISK)
    by_torquer(16, None)  # compiled
    costs = {name: us_a_second(*way) for name, way in ways.items()}
    ratios = {name: cost / costs["torquer"] for name, cost in costs.items()}
    print(json.dumps({"us_a_members_second": costs, "ratio_to_torquer": ratios}, indent=2))


if __name__ == "__main__":
    main()
