"""One page of A4 about an answer: question, verdict, plots, numbers, models, sources.

A `Page` is plain data and functions that draw; `draw_page` sets it. What does not fit is left out,
and the page says how much.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import SubFigure
from matplotlib.font_manager import FontProperties
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.textpath import TextToPath

from torquer.base.language import message, told, translated
from torquer.report.common.colours import GREEN, RED
from torquer.report.common.figure import DPI, FAINT, INK, TOLD, Sheet, save_vector

#: Sizes [inch]: of the sheet and its margin; gaps between columns, parts, and cells.
WIDTH, HEIGHT, MARGIN = 8.27, 11.69, 0.5
_GAP, _BETWEEN, _APART = 0.25, 0.1, 0.1
_WIDE = WIDTH - 2.0 * MARGIN
_COLUMN = 0.5 * (_WIDE - _GAP)
#: Text [pt], and the height of a line [of the size of its letters].
_TITLE, _HEAD, _TEXT, _LEADING = 14.0, 10.0, 8.0, 1.3
#: Most lines of the title, the question, the verdict, each note, each cell, each source.
_MOST = {"title": 2, "question": 3, "verdict": 4, "note": 2, "cell": 4, "source": 3}
#: Least height of all plots, greatest of notes, table and sources [inch].
_PLOTS, _NOTES, _TABLE, _SOURCES = 4.4, 1.2, 2.2, 2.0
#: Greatest part of a column for its labels.
_LABELS = 0.45
#: Colours of verdicts, by their looks: achieved, not achieved, none.
_COLOURS = {"done": GREEN, "missed": RED, "open": INK}
#: Part of a width that text may fill: renderers of pixels round the widths of letters.
_LEFT_FREE = 0.985
_PALE = "#555555"
_PLAIN = TextToPath()


class Plot(NamedTuple):
    """What draws into a part of the page, and how high that is beside others."""

    draw: Callable[[SubFigure], object]
    share: float = 1.0


@dataclass(frozen=True)
class Page:
    """What stands on a page; `look`: "done", "missed" or "open", the colour of the verdict.

    `numbers`, `models`: labels and values; two leading spaces set a label in. `table`: numbers of
    many columns, a row of labels and one of units first.
    """

    title: str
    question: str
    verdict: str
    look: str
    plots: Sequence[Plot]
    numbers: Sequence[tuple[str, str]]
    models: Sequence[tuple[str, str]]
    sources: Sequence[str]
    notes: Sequence[str] = ()
    table: Sequence[Sequence[str]] = ()

    def told(self) -> "Page":
        """The page in the language of the reader; models are told by their keys."""
        return replace(
            self,
            title=told(self.title),
            question=told(self.question),
            verdict=told(self.verdict),
            numbers=[(told(label), told(value)) for label, value in self.numbers],
            notes=[told(note) for note in self.notes],
            table=[[told(cell) for cell in row] for row in self.table],
        )


class _Line(NamedTuple):
    """A line of text at a distance [inch] from the left margin, below the line before."""

    text: str
    size: float = _TEXT
    left: float = 0.0
    bold: bool = False
    colour: str = INK
    new: bool = True

    @property
    def height(self) -> float:
        return self.size * _LEADING / 72.0 if self.new else 0.0


def draw_page(page: Page) -> Sheet:
    """The page as a figure; `savefig("page.pdf")` writes it."""
    figure = Sheet(figsize=(WIDTH, HEIGHT), dpi=DPI, facecolor="white", layout="constrained")
    page = page.told()
    head, table = _head(page), _table(page.table)
    sources = [f"[{number}] {source}" for number, source in enumerate(page.sources, 1)]
    below = _listed(translated("Sources"), sources, _SOURCES, "source")
    top, bottom = MARGIN + _tall(head), HEIGHT - MARGIN - _tall(below)
    columns = _columns(page, bottom - top - _tall(table) - _PLOTS - 4.0 * _BETWEEN)
    under = bottom - _BETWEEN - max(map(_tall, columns))
    over = under - _tall(table) - (_BETWEEN if table else 0.0)
    _write(figure, head, MARGIN, MARGIN)
    _draw_plots(figure, page.plots, top + _BETWEEN, over - _BETWEEN)
    _write(figure, table, MARGIN, over)
    for number, lines in enumerate(columns):
        _write(figure, lines, MARGIN + number * (_COLUMN + _GAP), under)
    _write(figure, below, MARGIN, bottom)
    return figure


def save_page(page: Page, folder: Path) -> Path:
    """Write a page as `page.pdf` into a folder."""
    return save_vector(draw_page(page), folder / "page.pdf")


def _tall(lines: Sequence[_Line]) -> float:
    return sum(line.height for line in lines)


def _head(page: Page) -> list[_Line]:
    """Satellite, question, verdict, notes."""
    title = _wrap(page.title, _WIDE, _TITLE, True, _MOST["title"])
    question = _wrap(page.question, _WIDE, _HEAD, False, _MOST["question"])
    verdict = _wrap(page.verdict, _WIDE, _HEAD, True, _MOST["verdict"])
    colour = _COLOURS[page.look]
    return [
        *(_Line(text, _TITLE, bold=True) for text in title),
        *(_Line(text, _HEAD) for text in question),
        *(_Line(text, _HEAD, bold=True, colour=colour) for text in verdict),
        *_listed("", [f"- {note}" for note in page.notes], _NOTES, "note"),
    ]


def _listed(title: str, texts: Sequence[str], tall: float, kind: str) -> list[_Line]:
    """A title and texts, one below the other, as many as fit into a height [inch]."""
    blocks = [[_Line(x) for x in _wrap(text, _WIDE, _TEXT, False, _MOST[kind])] for text in texts]
    head = [_Line(title, _HEAD, bold=True)] if title and texts else []
    return _fitting(head, blocks, tall)


def _columns(page: Page, tall: float) -> list[list[_Line]]:
    """Numbers beside models; models alone in both columns."""
    numbers, models = translated("Numbers"), translated("Models")
    if page.numbers:
        return [_column(numbers, page.numbers, tall), _column(models, page.models, tall)]
    half = -(-len(page.models) // 2)
    return [_column(models, page.models[:half], tall), _column(" ", page.models[half:], tall)]


def _column(title: str, rows: Sequence[tuple[str, str]], tall: float) -> list[_Line]:
    """A title and rows of labels and values, as many as fit."""
    widest = max((width_of(label, _TEXT) for label, _ in rows), default=0.0)
    at = min(widest + 2.0 * _APART, _LABELS * _COLUMN)
    return _fitting([_Line(title, _HEAD, bold=True)], [_row(*row, at) for row in rows], tall)


def _row(label: str, value: str, at: float) -> list[_Line]:
    """The lines of a row: the label's, and beside them the value's."""
    indent = _APART if label.startswith(" ") else 0.0
    labels = _wrap(label, at - indent - 0.5 * _APART, _TEXT, False, _MOST["cell"])
    values = _wrap(value, _COLUMN - at, _TEXT, False, _MOST["cell"])
    lines = []
    for number in range(max(len(labels), len(values))):
        name = labels[number] if number < len(labels) else ""
        lines.append(_Line(name, left=indent, colour=_PALE))
        if number < len(values):
            lines.append(_Line(values[number], left=at, new=False))
    return lines


def _table(table: Sequence[Sequence[str]]) -> list[_Line]:
    """Rows of cells, the first two of them labels and units; as many columns and rows as fit."""
    if not table:
        return []
    ends, at = [], 0.0
    for cells in zip(*table, strict=True):
        ends.append(at)
        at += max(width_of(cell, _TEXT) for cell in cells) + _APART
    shown = sum(end <= _WIDE for end in [*ends[1:], at])
    lines = [
        [
            _Line(cell, left=left, new=not k, colour=INK if number > 1 else _PALE)
            for k, (cell, left) in enumerate(zip(row[:shown], ends, strict=False))
        ]
        for number, row in enumerate(table)
    ]
    title = message("Numbers")
    if shown < len(ends):
        title = message("Numbers, without {count} columns", count=len(ends) - shown)
    head = [_Line(told(title), _HEAD, bold=True), *lines[0], *lines[1]]
    return _fitting(head, lines[2:], _TABLE)


def _fitting(head: list[_Line], blocks: Sequence[list[_Line]], tall: float) -> list[_Line]:
    """The blocks that fit below a head, and how many do not."""
    left, whole = len(blocks), _tall([*head, *chain(*blocks)])
    found, more = [*head], _Line("").height
    for block in blocks:
        if whole > tall and _tall([*found, *block]) + more > tall:
            break
        found += block
        left -= 1
    more_left = translated("… and {count} more", count=left)
    return [*found, *([_Line(more_left, colour=_PALE)] if left else [])]


def _write(figure: Sheet, lines: Sequence[_Line], left: float, top: float) -> None:
    """Text at a place [inch] from the upper left corner."""
    for line in lines:
        top += line.height
        baseline = top - line.size * (_LEADING - 1.0) / 72.0
        figure.text(
            (left + line.left) / WIDTH, 1.0 - baseline / HEIGHT, line.text, fontsize=line.size,
            fontweight="bold" if line.bold else "normal", color=line.colour, va="baseline",
            parse_math=False, gid=TOLD,
        )  # fmt: skip


def _draw_plots(figure: Sheet, plots: Sequence[Plot], top: float, bottom: float) -> None:
    """The plots between two heights [inch] from the top."""
    if not plots:
        return
    parts = [each.share for each in plots]
    heights = [(bottom - top) * part / sum(parts) for part in parts]
    grid = GridSpec(
        len(plots) + 2, 3, figure, height_ratios=[top, *heights, HEIGHT - bottom],
        width_ratios=[MARGIN, WIDTH - 2.0 * MARGIN, MARGIN],
    )  # fmt: skip
    for number, each in enumerate(plots, 1):
        each.draw(figure.add_subfigure(grid[number, 1]))
    figure.add_artist(Line2D([MARGIN / WIDTH, 1.0 - MARGIN / WIDTH], [1.0 - bottom / HEIGHT] * 2,
                             color=FAINT, lw=0.6))  # fmt: skip


def _wrap(text: str, wide: float, size: float, bold: bool, most: int) -> list[str]:
    """Text in lines of at most a width [inch]; beyond the last one, an ellipsis."""
    wide *= _LEFT_FREE
    lines: list[str] = []
    for word in re.split(r"[ \t\r\n]+", text.strip()):  # a space that does not break stays
        joined = f"{lines[-1]} {word}" if lines else word
        if lines and width_of(joined, size, bold) <= wide:
            lines[-1] = joined
            continue
        lines += _break(word, wide, size, bold, most)
        if len(lines) > most:  # what comes then is not measured: that takes most of the time
            break
    if len(lines) > most:
        lines = lines[:most]
        while width_of(f"{lines[-1]} …", size, bold) > wide:
            lines[-1] = lines[-1][:-1]
        lines[-1] += " …"
    return lines


def _break(word: str, wide: float, size: float, bold: bool, most: int) -> list[str]:
    """A word in pieces of at most a width [inch]; of a longer one no more than tells so."""
    if width_of(word, size, bold) <= wide:
        return [word]
    pieces = [""]
    for sign in word:
        if pieces[-1] and width_of(pieces[-1] + sign, size, bold) > wide:
            if len(pieces) > most:
                break
            pieces.append("")
        pieces[-1] += sign
    return pieces


@lru_cache(maxsize=4096)
def width_of(text: str, size: float, bold: bool = False) -> float:
    """Width of a text [inch], whatever the device; size in points."""
    font = FontProperties(size=size, weight="bold" if bold else "normal")
    return _PLAIN.get_text_width_height_descent(text, font, ismath=False)[0] / 72.0
