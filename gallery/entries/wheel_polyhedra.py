"""WHEEL Figs 2, 3, 5, 6: what four and six wheels hold, and after a loss."""

import numpy as np

from gallery.entry import Answer, Entry, within
from gallery.wheels import figure_in_space, without
from torquer.spacecraft.wheel_array.envelope import Envelope
from torquer.spacecraft.wheel_array.layout import four_sided_pyramid, regular_pyramid

COUNTS = {"P4": (14, 12), "P3": (8, 6), "P6": (32, 30), "P5": (22, 20)}


#: Vertices of section 8 in the printed order, half of them, in units of d1, d2, d3 or d4, d5, d5.
#: Where a minus sign has lost its place, it stands where the faces below close.
_R3 = 3.0**0.5
VERTICES = {
    "P4": [(0, 4, 0), (2, 2, 2), (2, 2, -2), (-2, 2, 2), (-2, 2, -2), (0, 0, -4), (-4, 0, 0)],
    "P3": [(-1, 3, -1), (1, 1, 1), (1, 1, -3), (-3, 1, 1)],
    "P6": [(6, 0, 0), (4, 2, 0), (4, 1, -_R3), (4, -1, -_R3), (4, -2, 0), (4, -1, _R3),
           (4, 1, _R3), (2, 3, -_R3), (2, 3, _R3), (2, 0, -2 * _R3), (2, -3, -_R3), (2, -3, _R3),
           (2, 0, 2 * _R3), (0, 2, 2 * _R3), (0, 4, 0), (0, 2, -2 * _R3)],
}  # fmt: skip
#: Faces of section 8.1 as printed, half of them; a negative number is a primed vertex. The text
#: has kept how many primes a line has.
FACES = {
    "P4": [(1, 4, 7, 5), (4, -6, -3, 7), (1, 5, 6, 3), (5, 7, -2, 6), (1, 3, -7, 2), (2, -6, 4, 1)],
    "P3": [(1, 2, -4, 3), (1, 3, -2, 4), (1, 4, -3, 2)],
}


def polyhedra() -> dict[str, Envelope]:
    """In units of a wheel's limit, at angles that show their shape."""
    four, six = four_sided_pyramid(60.0, 45.0), regular_pyramid(6, 54.7)
    sets = {"P4": four, "P3": without(four, 3), "P6": six, "P5": without(six, 5)}
    return {name: Envelope(axes) for name, axes in sets.items()}


def printed(name: str) -> np.ndarray:
    """Half of the vertices as printed, for the angles used here."""
    d4, d5, _ = regular_pyramid(6, 54.7)[5]
    scale = (d4, d5, d5) if name == "P6" else four_sided_pyramid(60.0, 45.0)[0]
    return np.array(VERTICES[name]) * scale


def odd_faces(found: Envelope, name: str) -> int:
    """How many printed faces, with their opposites, are none of ours, and how many of ours none."""
    vertices = printed(name)
    numbers = [np.array(face) for face in FACES[name]]
    loops = [
        side * np.sign(n)[:, None] * vertices[np.abs(n) - 1] for n in numbers for side in (1, -1)
    ]
    away = np.linalg.norm(found.vertices[:, None, None] - np.array(loops), axis=3)
    printed_loops = {_loop_of(nearest) for nearest in away.argmin(axis=0).tolist()}
    return len(printed_loops ^ {_loop_of(face) for face in found.faces})


def _loop_of(face) -> tuple:
    """A loop of vertices from its least number on, towards the lesser neighbour."""
    k, n = face.index(min(face)), len(face)
    loops = ([face[(k + way * step) % n] for step in range(n)] for way in (1, -1))
    return tuple(min(loops))


def farthest(found: Envelope, half) -> float:
    """Greatest distance from a vertex to the nearest printed one, or the other way round."""
    both = np.vstack([half, -half])
    away = np.linalg.norm(found.vertices[:, None] - both, axis=2)
    return float(max(away.min(axis=0).max(), away.min(axis=1).max()))


def compute() -> Answer:
    """Counts of vertices and faces, Euler's formula, and the printed lists of both."""
    found = polyhedra()
    # the list of P3 is that of the loss of the wheel along (d1, d2, d3)
    listed = found | {"P3": Envelope(without(four_sided_pyramid(60.0, 45.0), 0))}
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
        *(within(f"{name}: off the vertices of section 8", "the list",
                 farthest(listed[name], printed(name)), high=1e-12, unit="h_max")
          for name in VERTICES),
        *(within(f"{name}: faces, as loops of vertices, not of section 8", "the list",
                 odd_faces(listed[name], name), 0, 0) for name in FACES),
    ]  # fmt: skip
    titles = {"P4": "four wheels: P4", "P3": "one of them lost: P3", "P6": "six wheels: P6",
            "P5": "one of them lost: P5"}  # fmt: skip
    shown = [(words, found[name], None) for name, words in titles.items()]
    note = (
        "Alpha = 60, beta = 45, gamma = 54.7 deg, in units of a wheel's limit. The text preserves "
        "the vertices of P4, P3 and P6 and the faces of P4 and P3; the list of P3 is that of the "
        "loss of the wheel along (d1, d2, d3). Misplaced minus signs and primes were put where the "
        "printed faces close as rhombi; their number is as printed."
    )
    title = "What four and six wheels hold, and after a loss"
    return Answer(tuple(checks), {"": figure_in_space(title, shown)}, note)


ENTRY = Entry(ids=("WHEEL-2", "WHEEL-3", "WHEEL-5", "WHEEL-6"), compute=compute)
