"""Flight software in lock-step against the simulation alone: a day at 1 Hz, hours at 10 Hz.

Processor time of one core, in turns: `simulate`, the flight that stops at each control step, all
modules, all modules with an extended packet at every control step within protected frames. Prints
times real time and ratios to `simulate`; `make bench` runs it.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import torquer
from torquer.flight.software.core import Core
from torquer.flight.software.software import load_software

HERE = Path(__file__).parent
DAY = HERE.parent / "examples" / "chibis_m_day.toml"
TURNS = 5
#: Sampling [s] and length [s] of the flights.
CASES = ((1.0, 21600.0), (0.1, 3600.0))


def software(every_step_s: float, extended: bool):
    """The shipped software, with an extended packet at every control step or without any."""
    from torquer.flight.packets.software_file import AS_SHIPPED
    from torquer.scenario.toml_text import parse_toml, read_text

    data = parse_toml(read_text(AS_SHIPPED, "software"), "software")
    data["modules"]["tm"]["settings"]["extended_s"] = every_step_s if extended else 0.0
    for name in ("tm", "com", "aos", "stb"):
        data["modules"].setdefault(name, {})["period_s"] = every_step_s
    return load_software(data)


def by_simulate(scenario, sample_s):
    """Processor time of the simulation alone [s]."""
    torquer.simulate(scenario)


def by_flight(scenario, sample_s):
    """Of a flight that stops at every control step."""
    flight = torquer.Flight(scenario, keeps_computer=True)
    while flight.read() is not None:
        flight.command()


def by_modules(scenario, sample_s):
    """Of all modules, without extended packets."""
    core = Core(scenario, software(sample_s, extended=False))
    while core.tick() is not None:
        pass


def by_packets(scenario, sample_s):
    """Of all modules with an extended packet at every control step."""
    core = Core(scenario, software(sample_s, extended=True))
    while core.tick() is not None:
        pass


WAYS = {
    "simulate": by_simulate,
    "stopped at each control step": by_flight,
    "all modules": by_modules,
    "all modules, a packet each step": by_packets,
}


def clocked(way, *arguments) -> float:
    """Processor time of a call [s]."""
    begun_s = time.process_time()
    way(*arguments)
    return time.process_time() - begun_s


def main() -> None:
    """Measure, print, write benchmarks/flight_software.json."""
    found = {}
    for sample_s, duration_s in CASES:
        scenario = torquer.load_scenario(DAY).replace("control.sample_s", sample_s)
        scenario = scenario.replace("simulation.duration_s", duration_s)
        for way in WAYS.values():  # compiled and in the caches
            way(scenario.replace("simulation.duration_s", 100.0), sample_s)
        taken = {name: [] for name in WAYS}
        for _ in range(TURNS):
            for name, way in WAYS.items():
                taken[name].append(clocked(way, scenario, sample_s))
        least = {name: min(each) for name, each in taken.items()}
        steps = duration_s / sample_s
        print(f"{1.0 / sample_s:g} Hz, {duration_s / 3600.0:g} h")
        for name, took_s in least.items():
            speed, ratio = duration_s / took_s, took_s / least["simulate"]
            each_us = 1e6 * took_s / steps
            print(f"  {name:34} {each_us:6.1f} us a step, {speed:8.0f} x real time, {ratio:5.1f}")
        found[f"{1.0 / sample_s:g} Hz"] = {
            name: {"us_a_step": 1e6 * took_s / steps, "times_real_time": duration_s / took_s}
            for name, took_s in least.items()
        }
    (HERE / "flight_software.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
