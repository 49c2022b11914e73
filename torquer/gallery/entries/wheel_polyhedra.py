"""WHEEL Figs 2, 3, 5, 6: what four and six wheels hold, and after a loss."""

import itertools

import numpy as np

from torquer.gallery.entry import Answer, Entry, within
from torquer.gallery.wheels import figure_in_space, without
from torquer.wheel_array.envelope import Envelope
from torquer.wheel_array.layout import four_sided_pyramid, regular_pyramid

COUNTS = {"P4": (14, 12), "P3": (8, 6), "P6": (32, 30), "P5": (22, 20)}


def polyhedra() -> dict[str, Envelope]:
    """In units of a wheel's limit, at angles that show their shape."""
    four, six = four_sided_pyramid(60.0, 45.0), regular_pyramid(6, 54.7)
    sets = {"P4": four, "P3": without(four, 3), "P6": six, "P5": without(six, 5)}
    return {name: Envelope(axes) for name, axes in sets.items()}


def printed_p4() -> np.ndarray:
    """Vertices of P4 as printed in section 8.1, half of them, for the angles used here."""
    d1, d2, d3 = four_sided_pyramid(60.0, 45.0)[0]
    inner = [(2 * d1, a * 2 * d2, b * 2 * d3) for a, b in itertools.product((1, -1), repeat=2)]
    return np.array([(4 * d1, 0, 0), *inner, (0, 0, 4 * d3), (0, 4 * d2, 0)])


def printed_p6() -> np.ndarray:
    """Vertices of P6 as printed in section 8.2, half of them; d4 and d5 without the half."""
    d4, d5, _ = regular_pyramid(6, 54.7)[5]
    r = np.sqrt(3.0)
    rows = [(6, 0, 0), (4, 2, 0), (4, 1, r), (4, 1, -r), (4, -2, 0), (4, -1, r), (4, -1, -r),
            (2, 3, r), (2, 3, -r), (2, 0, -2 * r), (2, -3, -r), (2, -3, r), (2, 0, 2 * r),
            (0, 2, 2 * r), (0, 4, 0), (0, 2, -2 * r)]  # fmt: skip
    return np.array(rows) * (d4, d5, d5)


def farthest(found: Envelope, printed) -> float:
    """Greatest distance from a vertex to the nearest printed one, or the other way round."""
    both = np.vstack([printed, -printed])
    away = np.linalg.norm(found.vertices[:, None] - both, axis=2)
    return float(max(away.min(axis=0).max(), away.min(axis=1).max()))


def compute() -> Answer:
    """Counts of vertices and faces, Euler's formula, and the printed lists of vertices."""
    found = polyhedra()
    checks = []
    for name, (vertices, faces) in COUNTS.items():
        shape = found[name]
        pairs = (("vertices", vertices, shape.vertices), ("faces", faces, shape.faces))
        for what, wanted, parts in pairs:
            checks.append(within(f"{name}: {what}", str(wanted), len(parts), wanted, wanted))
    euler = [len(e.vertices) - len(e.edges) + len(e.faces) for e in found.values()]
    checks += [
        within("V - E + F, least", "Euler: 2", min(euler), 2, 2),
        within("V - E + F, greatest", "Euler: 2", max(euler), 2, 2),
        within("P4: off the vertices of (8.1)", "the list", farthest(found["P4"], printed_p4()),
               high=1e-12, unit="h_max"),
        within("P6: off the vertices of (8.2)", "the list", farthest(found["P6"], printed_p6()),
               high=1e-12, unit="h_max"),
    ]  # fmt: skip
    told = {"P4": "four wheels: P4", "P3": "one of them lost: P3", "P6": "six wheels: P6",
            "P5": "one of them lost: P5"}  # fmt: skip
    shown = [(words, found[name], None) for name, words in told.items()]
    note = (
        "Alpha = 60, beta = 45, gamma = 54.7 deg, in units of a wheel's limit. In (8.2) d4 and d5 "
        "are the components themselves; where they are introduced the text halves them."
    )
    title = "What four and six wheels hold, and after a loss"
    return Answer(tuple(checks), {"": figure_in_space(title, shown)}, note)


ENTRY = Entry(ids=("WHEEL-2", "WHEEL-3", "WHEEL-5", "WHEEL-6"), compute=compute)
