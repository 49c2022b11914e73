"""Compute entries: pictures into a folder, outcomes as data."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path

from gallery.drawing import save, save_small
from gallery.entry import Entry, Outcome


def picture_name(entry: Entry, name: str) -> str:
    """File name of an entry's picture."""
    return f"{entry.id}-{name}.png" if name else f"{entry.id}.png"


def compute(entry: Entry, out: Path, small: Path | None = None) -> Outcome:
    """Compute an entry and write its pictures into `out`, small ones into `small` if given.

    An existing small picture of timings is kept, as another would differ without need.
    """
    answer = entry.compute()
    pictures = []
    for name, figure in answer.figures.items():
        pictures.append(out / picture_name(entry, name))
        save(figure, pictures[-1])
        if small and not (answer.fleeting and (small / pictures[-1].name).exists()):
            save_small(figure, small / pictures[-1].name)
    return Outcome(entry, answer, tuple(pictures))


def compute_all(
    entries: Iterable[Entry],
    out: Path,
    small: Path | None = None,
    progress: Callable[[str, int], None] | None = None,
) -> list[Outcome]:
    """Compute entries one by one; pictures and results.json into `out`.

    `progress` is called with an entry's id and the count done before it.
    """
    outcomes = []
    for count, entry in enumerate(entries):
        if progress:
            progress(entry.id, count)
        outcomes.append(compute(entry, out, small))
    text = json.dumps([outcome.as_data() for outcome in outcomes], indent=2)
    (out / "results.json").write_text(text + "\n", encoding="utf-8")
    return outcomes
