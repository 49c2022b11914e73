"""The table of a fault campaign as Markdown, and its picture: faults over strikes, by verdict."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from torquer.campaign.faults.contents import WORDS, counts_in_words, fault_table
from torquer.campaign.faults.fly import FaultCampaign
from torquer.campaign.faults.verdict import DEGRADED, LOST, SAFE
from torquer.report.common.colours import GREEN, ORANGE, RED
from torquer.report.common.figure import INK, SMALL, foot, place, save_figure, sheet
from torquer.simulation.results.file import put

_COLOURS = {SAFE: GREEN, DEGRADED: ORANGE, LOST: RED}
_ROW, _COLUMN = 0.19, 1.25


def write_fault_report(found: FaultCampaign, out: Path) -> list[str]:
    """Write `faults.md` and `faults.png` into a folder; return their names."""
    put(out / "faults.md", markdown(found))
    save_figure(draw_faults(found), out / "faults.png")
    return ["faults.md", "faults.png"]


def markdown(found: FaultCampaign) -> str:
    """A page: how it was made, the counts, the whole table."""
    head, rows = fault_table(found)
    verdict, _ = found.verdict
    name, hours = found.scenario.name, found.scenario.length_s / 3600.0
    lines = [
        f"# Single faults: {name}",
        "",
        f"Made by `torquer faults`: flights of {hours:.3g} h; rate and angles are the greatest in",
        "the last revolution. A fault is noticed when the modes enter a state that they do not",
        "enter without it.",
        "",
        f"Without a fault: {verdict}. {'. '.join(counts_in_words(found))}.",
        "",
        *markdown_table(head, rows, WORDS),
    ]
    return "\n".join(lines) + "\n"


def markdown_table(head: list[str], rows: list[list[str]], words: Sequence[str]) -> list[str]:
    """The lines of a table; `words`: heads of the columns that hold words."""
    rule = ["---" if name in words else "--:" for name in head]
    return [_line(each) for each in (head, rule, *rows)]


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def draw_faults(found: FaultCampaign) -> Figure:
    """A matrix: a row for each fault, columns for each strike, with guards and without."""
    sides = [True, False] if found.guards else [True]
    columns = [(strike, guarded) for strike in found.strikes for guarded in sides]
    width, height = _COLUMN * len(columns), _ROW * len(found.faults)
    figure = sheet(2.0 + max(width, 3.0), height + 1.35, f"Single faults: {found.scenario.name}")
    axes = place(figure, 1.75, 1.05, width, height)
    rows = {fault.name: number for number, fault in enumerate(found.faults)}
    for row in found.rows:
        x, y = columns.index((row.strike, row.guarded)), rows[row.fault.name]
        outcome = row.outcome
        axes.add_patch(
            Rectangle((x, y), 1, 1, fc=_COLOURS[outcome.verdict], ec="white", lw=1.0, alpha=0.8)
        )
        seen = "  seen" if outcome.noticed_by else ""
        text = f"{outcome.rate_deg_s:.2g}{seen}"
        axes.text(x + 0.5, y + 0.53, text, ha="center", va="center", fontsize=6.5, color=INK)
    axes.set_xlim(0, len(columns))
    axes.set_ylim(len(rows), 0)
    axes.set_yticks([number + 0.5 for number in rows.values()], list(rows), fontsize=7)
    names = [_column(*column, bool(found.guards)) for column in columns]
    axes.set_xticks([k + 0.5 for k in range(len(columns))], names, fontsize=7)
    axes.tick_params(length=0, top=False, labeltop=True, bottom=False, labelbottom=False)
    axes.spines[:].set_visible(False)
    patches = [Patch(color=colour, alpha=0.8, label=name) for name, colour in _COLOURS.items()]
    figure.legend(
        handles=patches, loc="upper left", ncols=3, frameon=False, fontsize=SMALL,
        bbox_to_anchor=(0.0, 1.0 - 0.3 / figure.get_figheight()),
    )  # fmt: skip
    foot(figure, "greatest rate in the last revolution [deg/s]; seen: the modes noticed the fault")
    return figure


def _column(strike, guarded: bool, several: bool) -> str:
    side = ("\nwith guards" if guarded else "\nwithout") if several else ""
    mode = f"{strike.mode}, " if strike.mode else ""
    return f"{mode}{strike.at_s / 3600.0:.1f} h{side}"
