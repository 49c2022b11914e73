"""The table of flights with pairs of faults as Markdown."""

from pathlib import Path

from torquer.campaign.faults.pair_contents import WORDS, pair_counts_in_words, pair_table
from torquer.campaign.faults.pairs import PairCampaign
from torquer.report.campaign.faults import markdown_table
from torquer.simulation.results.file import put


def write_pair_report(found: PairCampaign, out: Path) -> list[str]:
    """Write `pairs.md` into a folder; return its name."""
    put(out / "pairs.md", pair_markdown(found))
    return ["pairs.md"]


def pair_markdown(found: PairCampaign) -> str:
    """A page: how it was made, the counts, the pairs by which the satellite is lost."""
    name, hours = found.scenario.name, found.scenario.length_s / 3600.0
    lines = [
        f"# Pairs of faults: {name}",
        "",
        f"Made by `torquer faults --pairs {len(found.rows)}`: flights of {hours:.3g} h, drawn by",
        f"seed {found.scenario.seed}. The second fault strikes with the first one or later. Lost:",
        "the rate exceeds 2 deg/s in the last revolution (or twice that without a fault), or the",
        "flight ended early. Unnoticed: no state switched the coils off.",
        "",
        f"Without a fault: {found.verdict[0]}. {'. '.join(pair_counts_in_words(found))}.",
        "",
        *markdown_table(*pair_table(found), WORDS),
    ]
    return "\n".join(lines) + "\n"
