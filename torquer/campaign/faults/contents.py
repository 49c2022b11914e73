"""The results of a fault campaign as plain data and as a dataset."""

import math

import numpy as np
import xarray as xr

from torquer.base.version import VERSION
from torquer.campaign.faults.fly import FaultCampaign, Row
from torquer.campaign.faults.verdict import VERDICTS, steps_in_words

#: Numbers of an outcome that the dataset has: unit and description.
_NUMBERS = {
    "rate_deg_s": ("deg/s", "greatest rate in the last revolution"),
    "energy_j": ("J", "energy of the coils"),
    "noticed_after_s": ("s", "time from the fault until the modes noticed it, infinite if never"),
}


def as_plain(found: FaultCampaign) -> dict:
    """Everything as plain data: value by key, unit in the key."""
    verdict, why = found.verdict
    nominal = found.nominal
    return {
        "scenario": found.scenario.name,
        "seed": found.scenario.seed,
        "flight_s": found.scenario.length_s,
        "guards": found.guards,
        "goals": [goal._asdict() for goal in found.goals],
        "without_fault": {
            "verdict": verdict, "why": why, "rate_deg_s": nominal.rate_deg_s,
            "goals": list(nominal.goals), "energy_j": nominal.energy_j, "steps": nominal.steps,
        },
        "strikes": [strike._asdict() for strike in found.strikes],
        "counts": {
            "with_guards": found.counts(True),
            **({"without_guards": found.counts(False)} if found.guards else {}),
        },
        "flights": [_row(row) for row in found.rows],
        "worst": _row(found.worst()),
    }  # fmt: skip


def _row(row: Row) -> dict:
    return {
        "fault": row.fault.name, "key": row.fault.key, "failure": row.fault.failure,
        **row.strike._asdict(), "guards": row.guarded, **row.outcome._asdict(),
    }  # fmt: skip


def fault_dataset(found: FaultCampaign) -> xr.Dataset:
    """Outcomes over (fault, strike, guards); `verdict`: its number among `VERDICTS`."""
    sides = [True, False] if found.guards else [True]
    shape = len(found.faults), len(found.strikes), len(sides)
    dims, order = ("fault", "strike", "guards"), [*found.rows]
    outcomes = [row.outcome for row in order]

    def over(values, dtype=float) -> np.ndarray:
        return np.array([*values], dtype).reshape(shape)

    verdict = over((VERDICTS.index(each.verdict) for each in outcomes), np.int8)
    flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": " ".join(VERDICTS)}
    made: dict[str, tuple] = {"verdict": (dims, verdict, flags)}
    for name, (unit, text) in _NUMBERS.items():
        values = over(getattr(each, name) for each in outcomes)
        made[name] = (dims, values, {"units": unit, "long_name": text})
    for number, goal in enumerate(found.goals):
        values = over(each.goals[number] for each in outcomes)
        attributes = {"units": goal.unit, "long_name": f"greatest {goal.signal}, last revolution"}
        made[f"goal_{number}"] = (dims, values, attributes)
    for name in ("why", "noticed_by"):
        made[name] = (dims, over((getattr(each, name) for each in outcomes), object).astype(str))
    coordinates = {
        "fault": [fault.name for fault in found.faults],
        "strike": ("strike", [strike.at_s for strike in found.strikes], {"units": "s"}),
        "mode": ("strike", [strike.mode for strike in found.strikes]),
        "guards": ["with", "without"][: len(sides)],
    }
    origin = {
        "scenario": found.scenario.model_dump_json(exclude_unset=True, exclude_none=True),
        "torquer": VERSION, "seed": found.scenario.seed,
    }  # fmt: skip
    return xr.Dataset(made, coordinates, origin)


def noticed_in_words(after_s: float) -> str:
    """How long it took to notice a fault."""
    if math.isinf(after_s):
        return "no"
    if after_s < 120.0:
        return f"{after_s:.0f} s"
    return f"{after_s / 60.0:.0f} min" if after_s < 7200.0 else f"{after_s / 3600.0:.1f} h"


#: Columns of the table that hold words.
WORDS = ("fault", "struck in", "verdict", "by", "without guards")


def fault_table(found: FaultCampaign) -> tuple[list[str], list[list[str]]]:
    """(Heads, rows of texts) of the table: a row for each fault and strike."""
    units = [f"{_short(goal.signal)} [{goal.unit}]" for goal in found.goals]
    head = ["fault", "struck in", "verdict", "rate [deg/s]", *units, "energy [kJ]"]
    head += ["noticed after", "by", *(["without guards"] if found.guards else [])]
    without = {(row.fault.name, row.strike): row.outcome for row in found.rows if not row.guarded}
    rows = []
    for row in (row for row in found.rows if row.guarded):
        outcome, at_h = row.outcome, row.strike.at_s / 3600.0
        cells = [
            row.fault.name,
            f"{row.strike.mode}, {at_h:.1f} h" if row.strike.mode else f"{at_h:.1f} h",
            outcome.verdict,
            f"{outcome.rate_deg_s:.2f}",
            *("-" if math.isnan(value) else f"{value:.1f}" for value in outcome.goals),
            f"{outcome.energy_j / 1e3:.2f}",
            noticed_in_words(outcome.noticed_after_s),
            outcome.noticed_by,
        ]
        if found.guards:
            free = without[row.fault.name, row.strike]
            cells.append(f"{free.verdict}, {free.rate_deg_s:.2f} deg/s")
        rows.append(cells)
    return head, rows


def _short(signal: str) -> str:
    return {"angle to the Sun": "Sun angle"}.get(signal, signal)


def counts_in_words(found: FaultCampaign) -> list[str]:
    """How many flights ended how, with guards and without; faults not safe and not noticed."""
    lines = []
    for guarded in (True, False) if found.guards else (True,):
        counts = ", ".join(f"{number} {name}" for name, number in found.counts(guarded).items())
        lines.append(f"{'With' if guarded else 'Without'} guards: {counts}")
    if not found.guards:
        lines = [line.removeprefix("With guards: ") for line in lines]
    unsafe = [row for row in found.rows if row.guarded and row.outcome.verdict != VERDICTS[0]]
    unnoticed = sum(not row.outcome.noticed_by for row in unsafe)
    lines.append(f"Not safe and not noticed: {unnoticed} of {len(unsafe)}")
    return [*lines, *steps_in_words(found.nominal, [row.outcome for row in found.rows])]
