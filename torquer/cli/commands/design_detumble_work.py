"""Work of `torquer design detumble`: the case from a scenario, its table, JSON, picture, files."""

import math
import sys
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from torquer.analysis.notes.bdot_notes import BDOT, most_gain, sampling_of, tumbling_of
from torquer.base.strict_json import json_text
from torquer.campaign.statistics import number, rate_interval
from torquer.cli.commands.design import DetumbleOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable, progress_bar, writing_to
from torquer.computer.laws.bdot import Bdot
from torquer.design.detumble_flights import GainFlights, Releases, chosen, fly_gains
from torquer.scenario.mission import ORBITAL_RATES
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import toml_of
from torquer.simulation.results.file import put
from torquer.theory.slow.detumbling import Tumbling, detumbling_time_s, knee_gain, turning_gain
from torquer.theory.slow.gains import Sampling, sampling_limit_rad_s

#: Revolutions flown without a limit of time: at least, theory's times to stop, at most.
_LEAST, _TIMES, _MOST = 10.0, 4.0, 60.0
#: Gains flown reach from the theory's over this factor to the theory's times it; and the part of
#: the gain that overshoots up to which one is chosen.
_FACTOR, _SAFE = 10.0, 0.5
_HEAD = ("gain", "theory", "stopped", "half", "90 %", "last", "energy", "mean power", "peak")
#: The law of a scenario that has none.
_ANY = Bdot(gain_a_m2_s_per_t=1.0)
_UNITS = ("A m^2 s/T", "h", "", "h", "h", "h", "J", "W", "of limit")


class Wanted(NamedTuple):
    """Rate after release, rate that counts as stopped [rad/s], time for it [s] or None."""

    tip_off_rad_s: float
    below_rad_s: float
    within_s: float | None


@dataclass(frozen=True)
class Sweep:
    """A satellite, what is wanted, what theory says, and flights by gain."""

    scenario: Scenario
    wanted: Wanted
    tumbling: Tumbling
    sampling: Sampling
    theory_gain: float
    most_gain: float
    revolutions: float
    flights: tuple[GainFlights, ...] = ()

    def theory_s(self, gain: float) -> float:
        """Mean time to stop by theory [s]."""
        return detumbling_time_s(self.tumbling, gain, *self.wanted[:2])

    @property
    def duration_s(self) -> float:
        """Duration of a flight [s]."""
        return self.revolutions * _period_s(self.scenario)

    @property
    def chosen(self) -> GainFlights:
        """The flights with the gain chosen."""
        return chosen(self.flights, self.wanted.within_s, _SAFE * self.most_gain)


def case_of(path: Path, how: DetumbleOptions, code: CodeOptions) -> Sweep:
    """The case of a scenario; `ValueError` if it has no coils, modes, or another law."""
    scenario = load_checked(path, code)
    law, wanted = _law_of(scenario) or _ANY, _wanted(scenario, how)
    sampling = sampling_of(scenario, law)
    limit = sampling_limit_rad_s(*sampling.times)
    if wanted.tip_off_rad_s >= limit:
        raise ValueError(
            f"--tip-off-deg-s: must be below {math.degrees(limit):.3g} deg/s, the greatest rate "
            f"that B-dot brakes with {sampling.in_words}; received "
            f"{math.degrees(wanted.tip_off_rad_s):.3g}"
        )
    tumbling = tumbling_of(scenario, law)
    most = most_gain(scenario, sampling, float(tumbling.fields_t.max()))
    gain = min(knee_gain(tumbling, *wanted[:2]), _turning_gain(scenario, tumbling), _SAFE * most)
    case = Sweep(scenario, wanted, tumbling, sampling, gain, most, _LEAST)
    return replace(case, revolutions=_revolutions(case))


def _turning_gain(scenario: Scenario, tumbling: Tumbling) -> float:
    r, v = (x[0] for x in scenario.orbit_environment().state(np.zeros(1)))
    normal = np.cross(r, v)
    inclination = math.acos(normal[2] / np.linalg.norm(normal))
    least = float(scenario.spacecraft.body.principal()[0][0])
    field_t = math.sqrt(np.mean(tumbling.fields_t**2))
    rate = scenario.orbit.rate_rad_s(scenario.start)
    return turning_gain(least, field_t, rate, inclination, tumbling.duty)


def _law_of(scenario: Scenario):
    """The scenario's law if it is of B-dot's kind; B-dot without a gain if it has none."""
    laws, modes = scenario.control.named()
    specs = list(laws.values())
    if scenario.spacecraft.coils is None:
        raise ValueError("spacecraft.coils: must be given; received none")
    if modes is not None or len(specs) > 1:
        raise ValueError("control: must have one law, without modes or stages; received more")
    if not specs or specs[0].kind == "off":
        return None
    if not isinstance(specs[0], BDOT):
        raise ValueError(f"control.law.kind: must be bdot or one like it; received {specs[0].kind}")
    return specs[0]


def _wanted(scenario: Scenario, how: DetumbleOptions) -> Wanted:
    mission, orbital = scenario.mission, scenario.orbit.rate_rad_s(scenario.start)
    tip_off = how.tip_off_deg_s or float(np.linalg.norm(scenario.initial.rate_deg_s))
    below = how.rate_below_deg_s or (mission and mission.rate_below_deg_s)
    below = below or math.degrees(ORBITAL_RATES * orbital)
    if tip_off <= below:
        raise ValueError(
            f"--tip-off-deg-s: must be above {below:.3g} deg/s, the rate that counts as stopped; "
            f"received {tip_off:.3g}"
        )
    within_s = how.within_s or (mission.within_s if mission else None)
    return Wanted(math.radians(tip_off), math.radians(below), within_s)


def _period_s(scenario: Scenario) -> float:
    return 2.0 * math.pi / scenario.orbit.rate_rad_s(scenario.start)


def _revolutions(case: Sweep) -> float:
    """Revolutions flown: beyond the time allowed, to see that the rate stays low."""
    period_s, within_s = _period_s(case.scenario), case.wanted.within_s
    if within_s is not None:
        return float(math.ceil(within_s / period_s) + 2)
    needed = _TIMES * case.theory_s(case.theory_gain) / period_s
    return float(math.ceil(min(max(_LEAST, needed), _MOST)))


def flown(case: Sweep, how: DetumbleOptions, progress=None) -> Sweep:
    """The case with its flights, with the scenario's own gain among them."""
    own, gain = _law_of(case.scenario), case.theory_gain
    most = min(gain * _FACTOR, case.most_gain)
    gains = {
        float(f"{each:.4g}") for each in (*np.geomspace(gain / _FACTOR, most, how.gains), gain)
    }
    if own is not None:
        gains.add(own.gain_a_m2_s_per_t)
    laws = [
        (own or _ANY).model_copy(update={"gain_a_m2_s_per_t": each}).law() for each in sorted(gains)
    ]
    releases = Releases(math.degrees(case.wanted.tip_off_rad_s), how.runs, how.times)
    below = math.degrees(case.wanted.below_rad_s)
    flights = fly_gains(case.scenario, laws, releases, below, case.revolutions, progress)
    return replace(case, flights=tuple(flights))


def show(path: Path, how: DetumbleOptions, code: CodeOptions) -> int:
    """Fly the gains and print them; write picture and scenario if a folder is given."""
    case, out = case_of(path, how, code), how.out
    if out is not None:
        make_writable(out)
    with _progress() as progress:
        case = flown(case, how, progress)
    files = [] if out is None else _write(case, out)
    if how.json:
        print(json_text(_data(case, files)))
        return 0
    rows = (_HEAD, _UNITS, *(_row(case, each) for each in case.flights))
    print(*("".join(f"{cell:>11}" for cell in row) for row in rows), sep="\n")
    print(*_verdict(case), sep="\n")
    print(*(f"note: {note}" for note in _notes(case)), sep="\n")
    if files:
        print(f"{out}: {', '.join(Path(file).name for file in files)}")
    return 0


@contextmanager
def _progress():
    """Callback for a bar on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import MofNCompleteColumn, TimeRemainingColumn

    with progress_bar(MofNCompleteColumn(), TimeRemainingColumn()) as bar:
        task = bar.add_task("flights", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _row(case: Sweep, each: GainFlights) -> tuple[str, ...]:
    times = (case.theory_s(each.gain), *(each.settled_by(part) for part in (0.5, 0.9, 1.0)))
    theory, half, most, last = (_hours(t) for t in times)
    stopped = f"{each.settled_within(_allowed_s(case))}/{len(each.settled_s)}"
    energy = float(each.energy_j.mean())
    mean, peak = f"{energy / case.duration_s:.3g}", f"{100.0 * _peak_share(case, each):.3g} %"
    return (f"{each.gain:.3g}", theory, stopped, half, most, last, f"{energy:.4g}", mean, peak)


def _hours(time_s: float) -> str:
    return f"{time_s / 3600.0:.3g}" if math.isfinite(time_s) else "never"


def _allowed_s(case: Sweep) -> float:
    """Time [s] by which releases must have stopped; without one any time in the flight counts."""
    return math.inf if case.wanted.within_s is None else case.wanted.within_s


def _peak_share(case: Sweep, each: GainFlights) -> float:
    """Greatest dipole of a coil over the least limit of the coils."""
    return float(each.peak_a_m2.max() / case.tumbling.coils.limits_a_m2().min())


def _verdict(case: Sweep) -> list[str]:
    """The gain chosen, by which rule, and what is known of how many stop."""
    best, wanted = case.chosen, case.wanted
    count, runs = best.settled_within(_allowed_s(case)), len(best.settled_s)
    low, high = (100.0 * end for end in rate_interval(count, runs))
    until = f" within {_hours(_allowed_s(case))} h" if wanted.within_s is not None else ""
    lines = [
        f"gain: gain_a_m2_s_per_t = {best.gain:.4g}",
        f"{count} of {runs} releases at {math.degrees(wanted.tip_off_rad_s):.3g} deg/s stay below "
        f"{math.degrees(wanted.below_rad_s):.3g} deg/s{until} "
        f"({low:.0f}..{high:.0f} % with 95 % confidence), each flown for {case.revolutions:g} rev",
    ]
    if wanted.within_s is not None and count < runs:
        lines.append(f"no gain stops all of them in time: {_why_late(case, best)}")
    return lines


def _why_late(case: Sweep, best: GainFlights) -> str:
    least_s = case.theory_s(1e4 * case.theory_gain)
    return (
        f"coils always at their limits would need about {_hours(least_s)} h on average, by theory; "
        f"with this gain a coil reached {100.0 * _peak_share(case, best):.3g} % of its limit"
    )


def _notes(case: Sweep) -> list[str]:
    """What theory says beyond the flights, and what is left out."""
    craft, coils, sampling = case.scenario.spacecraft, case.tumbling.coils, case.sampling
    limit = math.degrees(sampling_limit_rad_s(*sampling.times))
    notes = [f"B-dot brakes rates up to {limit:.4g} deg/s with {sampling.in_words}"]
    if math.isfinite(case.most_gain):
        notes.append(
            f"gains above {case.most_gain:.3g} A m^2 s/T overshoot in the strongest field of the "
            "orbit; at most half of that is chosen"
        )
    turning = _turning_gain(case.scenario, case.tumbling)
    notes.append(
        f"theory's times are means, for gains up to about {turning:.3g} A m^2 s/T; beyond, "
        "rotation about the field outlasts the rest"
    )
    noise_t = 1e-9 * craft.magnetometer.noise_nt
    if sampling.difference_s > 0.0 and noise_t > 0.0:
        dipole = case.chosen.gain * noise_t * math.sqrt(2.0) / sampling.difference_s
        share = 100.0 * dipole / float(coils.limits_a_m2().min())
        notes.append(
            f"the magnetometer's noise commands {dipole:.2g} A m^2 RMS per axis with the gain "
            f"chosen, {share:.2g} % of the limit; a constant bias cancels in the difference"
        )
    bias = float(np.linalg.norm(craft.gyro.bias_deg_s))
    if "rate" in (_law_of(case.scenario) or _ANY).needs and bias > 0.0:
        notes.append(f"the gyro's bias of {bias:.2g} deg/s is a rate that the law tends to")
    if coils.power_at_limit_w is None:
        notes.append("energies and powers are those of coils that take 1 W at their limit")
    if (
        case.scenario.control.estimator is not None
        and "rate" in (_law_of(case.scenario) or _ANY).needs
    ):
        notes.append("the law reads the sensors, not the scenario's estimator")
    return notes


def _data(case: Sweep, files: list[str]) -> dict:
    wanted = case.wanted
    return {
        "name": case.scenario.name,
        "tip_off_deg_s": math.degrees(wanted.tip_off_rad_s),
        "rate_below_deg_s": math.degrees(wanted.below_rad_s),
        "within_s": wanted.within_s,
        "gain_a_m2_s_per_t": case.chosen.gain,
        "theory_gain_a_m2_s_per_t": case.theory_gain,
        "overshoot_gain_a_m2_s_per_t": number(case.most_gain),
        "revolutions": case.revolutions,
        "flights": [_flights_data(case, each) for each in case.flights],
        "notes": _notes(case),
        "files": files,
    }


def _flights_data(case: Sweep, each: GainFlights) -> dict:
    count, runs = each.settled_within(_allowed_s(case)), len(each.settled_s)
    energy = float(each.energy_j.mean())
    return {
        "gain_a_m2_s_per_t": each.gain,
        "theory_s": number(case.theory_s(each.gain)),
        "runs": runs,
        "stopped": count,
        "interval": list(rate_interval(count, runs)),
        "settled_s": {
            f"{part:g}": number(each.settled_by(part)) for part in (0.5, 0.9, 1.0)
        },
        "energy_j": energy,
        "mean_power_w": energy / case.duration_s,
        "peak_share": _peak_share(case, each),
    }  # fmt: skip


def _write(case: Sweep, out: Path) -> list[str]:
    """gains.png, and scenario.toml with the gain chosen."""
    from torquer.report.theory.detumbling import draw_gains

    law = (_law_of(case.scenario) or _ANY).model_copy(
        update={"gain_a_m2_s_per_t": float(f"{case.chosen.gain:.4g}")}
    )
    named = case.scenario.control.named().laws
    key = case.scenario.control.key_of(next(iter(named))) if named else "law"
    changed = case.scenario.replace(f"control.{key}", law.model_dump(mode="json"))
    text = toml_of(changed.model_dump(mode="json", exclude_unset=True, exclude_none=True))
    with writing_to(out):
        picture = draw_gains(case, out / "gains.png")
        return [str(picture), str(put(out / "scenario.toml", text))]
