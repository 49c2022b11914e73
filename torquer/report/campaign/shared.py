"""What the pictures of campaigns share: labels, scales, empirical distributions."""

import re
from collections import Counter
from collections.abc import Iterable
from textwrap import wrap

import numpy as np
import xarray as xr

from torquer.base.language import joined, message, told
from torquer.campaign.summary import correlations, with_unit
from torquer.report.common.figure import INK, place
from torquer.scenario.keys import key_unit, key_words

#: Letters of a label beside bars, room of a letter [inch], where the bars end [inch].
_LETTERS, _LETTER_IN, _BARS_END_IN = 54, 0.058, 6.9
#: Ratio of values from which on a scale is logarithmic.
_WIDE = 100.0
#: An input: its place in the file, whether of its direction, and which component of it.
_INPUT = re.compile(r"(.*?)(\.direction(?=\[))?((?:\[\d+\])*)")


def literal(text: str) -> str:
    """Text for matplotlib, dollar signs as they are."""
    return text.replace("$", r"\$")


def in_words(name: str, unit: str = "") -> str:
    """An outcome or a signal as a reader says it: `error_deg` is error, its unit told apart."""
    return key_words(name).removesuffix(f" {unit.lower()}") or name


def outcome_in_words(summary: dict, name: str) -> str:
    """An outcome of a summary, or the success, as a reader says it."""
    return in_words(name, summary["outcomes"].get(name, {}).get("unit", ""))


def axis_label(name: str, unit: str) -> str:
    """An outcome or a signal in words and its unit in brackets, for matplotlib and plotly alike."""
    return with_unit(in_words(name, unit), unit)


def input_labels(keys: Iterable[str]) -> dict[str, str]:
    """Inputs in words and their units in brackets; as the key where two would read the same."""
    said = {key: _together([_input_label(each) for each in key.split(", ")]) for key in keys}
    counts = Counter(said.values())
    return {key: label if counts[label] == 1 else key for key, label in said.items()}


def _together(labels: list[str]) -> str:
    return joined(", ", labels) if len(labels) > 1 else labels[0]


def _input_label(key: str) -> str:
    """`control.law.gain_a_m2_s_per_t` is law gain [A m² s/T]; parts as in `as_columns`."""
    found = _INPUT.fullmatch(key.strip("|"))
    place, cosine, within = found.groups() if found else (key, None, "")
    *table, last = place.replace(".parameters.", ".").split(".")[-2:]
    words = key_words(last)
    if table == ["initial"]:  # one phrase with what follows
        words = " ".join([*table, words])
    elif table:
        words = message("{table} {words}", table=table[0].replace("_", " "), words=words)
    if key.startswith("|"):
        words = message("size of {words}", words=words)
    if cosine:
        words = message("direction of {words}", words=words)
    if within:
        numbers = ", ".join(re.findall(r"[0-9]+", within))
        words = message("{words}, component {numbers}", words=words, numbers=numbers)
    unit = "" if cosine else key_unit(last)
    return message("{name} [{unit}]", name=words, unit=unit) if unit else words


def fit_label(text: str, length: int, lines: int = 1) -> str:
    """A label in the language of the reader, in lines of so many letters, for matplotlib.

    What is too long keeps its end: keys differ there.
    """
    said = told(text)
    while len(rows := wrap(said, length)) > lines:
        said = f"…{said.lstrip('…')[1:]}"
    return literal("\n".join(rows))


def bar_labels(keys: Iterable[str]) -> list[str]:
    """Labels of inputs beside their bars."""
    return [fit_label(label, _LETTERS) for label in input_labels(keys).values()]


def bar_axes(figure, groups: Iterable[Iterable[str]]):
    """Makes axes for the bars of inputs, wherever the longest label of all groups leaves room.

    Of (top [inch], height [inch], title).
    """
    longest = max(len(label) for keys in groups for label in bar_labels(keys))
    left = 0.35 + _LETTER_IN * longest
    wide = _BARS_END_IN - left

    def make(top: float, height: float, title: str):
        axes = place(figure, left, top, wide, height)
        axes.set_title(literal(title), fontsize=9.5, loc="left", color=INK, pad=3,
                       x=(0.16 - left) / wide)  # fmt: skip
        return axes

    return make


def correlated(result: xr.Dataset) -> dict[str, dict[str, float]]:
    """Rank correlations with inputs, by outcome; of outcomes that have some."""
    return {name: found for name, found in correlations(result).items() if found}


def settled_range(counts, found: np.ndarray) -> tuple[float, float] | None:
    """Range of estimates and intervals [counts, 3] without the first intervals, very wide ones."""
    shown = np.concatenate([found[:, 0], found[counts >= min(10, counts[-1])].ravel()])
    ends = shown[np.isfinite(shown)]
    if not len(ends) or np.ptp(ends) == 0.0:
        return None
    margin = 0.05 * np.ptp(ends)
    return float(ends.min() - margin), float(ends.max() + margin)


def is_wide(values: np.ndarray) -> bool:
    """Whether positive values spread so far that a logarithmic scale shows them better."""
    known = values[np.isfinite(values)]
    if not len(known) or known.min() <= 0.0:
        return False
    low, high = np.quantile(known, (0.02, 0.98))
    return bool(high > _WIDE * low)


def steps(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Empirical distribution function of values [n], infinite ones not drawn but counted: (x, F).

    At most some 2000 corners; F(x) is the share of all values that do not exceed x.
    """
    ordered = np.sort(values)
    rows = np.unique(np.linspace(0, len(ordered) - 1, min(len(ordered), 2000)).astype(int))
    x, part = ordered[rows], (rows + 1) / len(ordered)
    drawn = np.isfinite(x)
    below = float(np.mean(np.isneginf(values)))
    x, part = x[drawn], part[drawn]
    return np.concatenate([x[:1], x]), np.concatenate([[below], part])
