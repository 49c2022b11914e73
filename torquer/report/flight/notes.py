"""What the reader of a report should know before the numbers."""

import numpy as np

from torquer.analysis.wheels import AT_LIMIT
from torquer.control.user import GivenLaw
from torquer.report.flight.view import View
from torquer.scenario.notes import notes_of
from torquer.simulation.resolution import notes_on_steps
from torquer.simulation.result import COMPLETE


def notes(view: View) -> list[str]:
    """What the reader should know before the numbers, one line each."""
    attrs = view.result.attrs
    told = []
    if attrs["ended"] != COMPLETE:
        told.append(f"this run is not complete: {attrs['ended']}")
    for name in ("law", "wheel_law"):
        if attrs.get(f"{name}_runs_as", "compiled") != "compiled":
            told.append(f"the law {attrs[name]} runs as {attrs[f'{name}_runs_as']}")
    return [*told, *_notes_on_the_laws(view), *_notes_on_the_record(view)]


def _notes_on_the_laws(view: View) -> list[str]:
    """Which laws are not in the scenario's text, and the notes on the scenario."""
    control = view.scenario.control
    told = [
        f"the law {law.name} was given in Python: to fly this again it must be given again"
        for law in (control.law, control.wheel_law)
        if isinstance(law, GivenLaw)
    ]
    return [*told, *notes_of(view.scenario)]


def _notes_on_the_record(view: View) -> list[str]:
    told = []
    if view.every > 1:
        told.append(
            f"pictures and the notes on the record take one of {view.every} records, "
            f"{view.record_s:g} s apart; the summary takes all"
        )
    if not view.can_follow():
        told.append(
            f"the body turns up to {view.turn_between_records_deg():.0f} deg between two records "
            f"({view.record_s:g} s apart): pictures of vectors in body axes "
            "show the envelope of fast turning, not each turn"
        )
    over = np.abs(view.values("b_body")).max(axis=1) > (
        1e-9 * view.scenario.spacecraft.magnetometer.range_nt
    )
    if over.any():
        part = f"{over.mean():.0%} of the record"
        told.append(f"the field was beyond the magnetometer's range in {part}")
    return [*told, *notes_on_steps(view.result), *_notes_on_full_wheels(view)]


def _notes_on_full_wheels(view: View) -> list[str]:
    """Which wheels were at a limit, and for how long."""
    if view.wheels is None:
        return []
    told, shares = [], (view.wheels.momentum_shares, view.wheels.torque_shares)
    for of_what, full in zip(("momentum", "torque"), np.array(shares) >= AT_LIMIT, strict=True):
        if full.any():
            numbers = ", ".join(map(str, np.flatnonzero(full.any(axis=0))))
            rows = np.count_nonzero(full.any(axis=1))
            told.append(
                f"wheels at their limit of {of_what} in {rows} of {len(full)} records: {numbers}"
            )
    return told
