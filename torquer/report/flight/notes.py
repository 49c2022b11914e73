"""Caveats on a run, for the head of its report."""

import numpy as np

from torquer.analysis.notes.notes import write_notes
from torquer.analysis.notes.run_notes import run_notes
from torquer.analysis.verdict import clock_text
from torquer.analysis.wheel_use import AT_LIMIT
from torquer.computer.blocks.user import GivenLaw
from torquer.report.flight.view import View
from torquer.simulation.results.dataset import COMPLETE


def notes(view: View) -> list[str]:
    """Caveats that come before the numbers, one line each."""
    attrs = view.result.attrs
    lines = []
    if attrs["ended"] != COMPLETE:
        lines.append(f"this run is not complete: {attrs['ended']}")
    lines += [
        f"the {view.kind_of(key)} {law['name']} runs as {law['runs_as']}"
        for key, law in view.laws.items()
        if law["runs_as"] != "compiled"
    ]
    return [*lines, *_notes_on_the_laws(view), *_notes_on_the_record(view)]


def _notes_on_the_laws(view: View) -> list[str]:
    """Laws that the scenario's text does not contain, and the notes on the scenario."""
    lines = [
        f"the law {law.name} was passed from Python: to repeat the run it must be passed again"
        for law in view.scenario.control.named().laws.values()
        if isinstance(law, GivenLaw)
    ]
    return [*lines, *write_notes(view.scenario)]


def _notes_on_the_record(view: View) -> list[str]:
    lines = []
    if view.every > 1:
        lines.append(
            f"plots and the notes on the record use one record in {view.every}, "
            f"{view.record_s:g} s apart; the summary uses all"
        )
    if not view.can_follow():
        lines.append(
            f"the body rotates by up to {view.turn_between_records_deg():.0f} deg between records "
            f"({view.record_s:g} s apart): plots in body axes show the envelope of the fast "
            "rotation, not each revolution"
        )
    over = np.abs(view.values("b_body")).max(axis=1) > (
        1e-9 * view.scenario.spacecraft.one_of("magnetometer").range_nt
    )
    if over.any():
        part = f"{100.0 * over.mean():.2g} % of the run"
        lines.append(f"the field exceeded the magnetometer's range in {part}")
    return [*lines, *run_notes(view.result), *_notes_on_full_wheels(view)]


def _notes_on_full_wheels(view: View) -> list[str]:
    """Which wheels were at a limit, and for how long."""
    if view.wheels is None:
        return []
    lines, shares = [], (view.wheels.momentum_shares, view.wheels.torque_shares)
    for of_what, full in zip(("momentum", "torque"), np.array(shares) >= AT_LIMIT, strict=True):
        if full.any():
            numbers = np.flatnonzero(full.any(axis=0))
            part = full.any(axis=1).mean()
            wheels = f"wheel{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"
            time = clock_text(float(part * view.end_s))
            lines.append(
                f"{wheels} at the {of_what} limit for {100.0 * part:.2g} % of the run ({time})"
            )
    return lines
