"""The results of flights with pairs of faults as plain data and as a table."""

from torquer.campaign.faults.pairs import PairCampaign, PairRow
from torquer.campaign.faults.verdict import steps_in_words

#: Columns of the table that hold words.
WORDS = ("first", "second", "noticed by", "coils off by")


def pairs_as_plain(found: PairCampaign) -> dict:
    """Everything as plain data: value by key, unit in the key."""
    verdict, why = found.verdict
    return {
        "scenario": found.scenario.name,
        "seed": found.scenario.seed,
        "flight_s": found.scenario.length_s,
        "goals": [goal._asdict() for goal in found.goals],
        "without_fault": {"verdict": verdict, "why": why, "rate_deg_s": found.nominal.rate_deg_s},
        "pairs": len(found.rows),
        "counts": found.counts(),
        "flights": [_row(row) for row in found.rows],
        "worst": _row(found.worst()),
    }


def _row(row: PairRow) -> dict:
    return {
        "number": row.pair.number, **row.pair.tables(), **row.outcome._asdict(),
        "coils_off_by": row.coils_off_by, "ended": row.ended,
    }  # fmt: skip


def pair_table(found: PairCampaign) -> tuple[list[str], list[list[str]]]:
    """(Heads, rows of texts) of the table: the pairs by which the satellite is lost."""
    head = ["pair", "first", "at [h]", "second", "at [h]", "rate [deg/s]"]
    rows = [_cells(row) for row in found.rows if row.is_lost]
    return [*head, "noticed by", "coils off by"], rows


def _cells(row: PairRow) -> list[str]:
    hours = [f"{at_s / 3600.0:.2f}" for at_s in row.pair.at_s]
    (first, second), outcome = row.pair.faults, row.outcome
    rate = "ended" if row.ended else f"{outcome.rate_deg_s:.2f}"
    names = [first.name, hours[0], second.name, hours[1]]
    return [str(row.pair.number), *names, rate, outcome.noticed_by, row.coils_off_by]


def pair_counts_in_words(found: PairCampaign) -> list[str]:
    """How many flights ended how; how many are lost with the coils left to work; the worst."""
    counts, worst = found.counts(), found.worst()
    verdicts = ", ".join(f"{counts[each]} {each}" for each in ("safe", "degraded", "lost"))
    first, second = worst.pair.faults
    return [
        f"{len(found.rows)} pairs: {verdicts}",
        f"Lost unnoticed, the coils left to work: {counts['lost_unnoticed']}; "
        f"flights that ended early: {counts['ended']}",
        f"Worst: pair {worst.pair.number}, {first.name} and {second.name}, "
        f"{worst.outcome.verdict}{': ' + worst.outcome.why if worst.outcome.why else ''}",
        *steps_in_words(found.nominal, [row.outcome for row in found.rows]),
    ]
