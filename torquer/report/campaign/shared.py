"""What the pictures of campaigns share: labels, scales, empirical distributions."""

import numpy as np

#: Ratio of values from which on a scale is logarithmic.
_WIDE = 100.0


def literal(text: str) -> str:
    """Text for matplotlib, dollar signs as they are."""
    return text.replace("$", r"\$")


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
