"""FIELD (2.8)-(2.14): the first tongue of Mathieu's equation, for a satellite with a magnet.

A permanent magnet on a polar orbit follows the field as it turns; the gravity gradient swings its
stiffness. FIELD expands in the depth of this swing: chi = eta/lambda2 for the averaged model, and
eta/lambda2 - 1/3 for the direct dipole, whose uneven turn swings it the other way.
"""

import numpy as np

from gallery.drawing import BLUE, RED, label, new_figure
from gallery.entry import Answer, Entry, consistent, near, within
from gallery.theory.mathieu import first_tongue
from gallery.theory.planar_magnet import closed_tongue, motion_edges, tongue_edges, uniform_rotation
from torquer.theory.periodic.floquet import chart

MODELS = ("averaged", "direct dipole")
STEP = 0.02


def edges_at(mu: int, eta: float) -> tuple[float, float]:
    """Edges (cosine's, sine's) in lambda2 of the first tongue, by computed solutions."""
    return tongue_edges(uniform_rotation.with_parameters(mu=float(mu)), eta)


def depth(mu: int, eta, lambda2):
    """chi: depth of the swing of the stiffness over its mean."""
    return eta / lambda2 - mu / 3.0


def coefficients(mu: int) -> tuple[float, float]:
    """Factors of chi and chi^2 in the sine's edge, from computed edges where chi is small."""
    etas = mu / 3.0 + STEP * np.array([1.0, 2.0])
    edges = np.array([edges_at(mu, eta) for eta in etas])
    chi = (depth(mu, etas[:, None], edges) * [-1.0, 1.0]).ravel()  # the cosine's edge has -chi
    powers = np.stack([chi, chi**2, chi**3, chi**4], axis=1)
    return tuple(np.linalg.solve(powers, edges.ravel() - 1.0)[:2])


def farthest_series() -> float:
    """Greatest |series - computed edge| over |chi|^3, both models: a number if to chi^2 right."""
    left = []
    for mu in (0, 1):
        for eta in mu / 3.0 + np.array([-0.2, -0.1, 0.05, 0.1, 0.2]):
            edges = np.array(edges_at(mu, eta))
            chi = depth(mu, eta, edges)
            series = [first_tongue(chi[0])[0], first_tongue(chi[1])[1]]
            left.append(np.abs((series - edges) / chi**3).max())
    return max(left)


def moment_ratio(eta: float, lambda2: float) -> float:
    """(A - B) omega0^2 over m mu_e/r^3 (B0 is 1.5 of mu_e/r^3 on a polar orbit)."""
    return eta / 3.0 / (lambda2 / 1.5)


def compute() -> Answer:
    """Factors of the series, where the tongues shut, and both charts."""
    dipole_shut = closed_tongue(lambda eta: edges_at(1, eta), 0.1, 0.6)
    motion_shut = closed_tongue(lambda eta: motion_edges(eta, 1, (0.5, 1.7)), 0.28, 0.38)
    averaged_shut = closed_tongue(lambda eta: edges_at(0, eta), -0.3, 0.2)
    checks = []
    for mu, model in enumerate(MODELS):
        first, second = coefficients(mu)
        checks += [
            near(f"{model}: factor of chi", "0.5", first, tolerance=1e-5, printed="1/2"),
            near(f"{model}: factor of chi^2", "0.21875", second, tolerance=1e-4, printed="7/32"),
        ]
    checks += [
        within("series to computed edges, over chi^3, |chi| up to 0.3", "edges to chi^2",
               farthest_series(), high=1.0),
        within("averaged: tongue closes at (A - B) omega0^2 over m mu_e/r^3",
               "absent for A = B", moment_ratio(*averaged_shut), -1e-6, 1e-6),
        near("direct dipole: tongue closes at (A - B) omega0^2 over m mu_e/r^3", str(1.0 / 6.0),
             moment_ratio(*dipole_shut), tolerance=1e-6, printed="1/6"),
        consistent(near("the same, for the motion itself, not linearised", str(1.0 / 6.0),
                        moment_ratio(*motion_shut), tolerance=0.01 / 6.0,
                        printed="that of the linear equation, to 1 %")),
    ]  # fmt: skip
    note = (
        "chi is the ratio of the two terms of the stiffness; with lambda2 chi given in its place "
        "7/32 becomes -1/32. For the direct dipole FIELD says that its equation holds near the "
        "nodes and about the field's direction. In fact it holds at all u, about a uniform "
        "rotation (near a node the dipole field rotates by 2u, not u). The edges for the motion "
        "itself, which oscillates about the uniform rotation, are dashed: the tongue closes within "
        "1 % of the printed place, and far from it the linear equation does not apply."
    )
    return Answer(tuple(checks), {"": picture()}, note)


def picture():
    """Where a multiplier leaves the unit circle (half the trace beyond one); edges over it."""
    figure, panels = new_figure("Magnet that follows the field: first tongue (FIELD 2.2)", 2, 7.0)
    lambda2, eta = np.linspace(0.4, 1.8, 141), np.linspace(-1.0, 1.0, 81)
    for mu, axes in enumerate(panels):
        system = uniform_rotation.with_parameters(mu=float(mu))
        found = chart(system, ("lambda2", lambda2), ("eta", eta))
        half_trace = 0.5 * np.abs(found.trace.values)
        axes.contourf(lambda2, eta, half_trace, levels=[1.0, np.inf], colors=["#d5e3ef"])
        axes.fill_between([], [], color="#d5e3ef", label="unstable, by Floquet multipliers")
        chi = np.linspace(-1.0, 1.0, 201)
        for side, edge in enumerate(first_tongue(chi)):
            name = None if side else "series to chi² (2.13)"
            axes.plot(edge, edge * (chi + mu / 3.0), color=BLUE, lw=1.3, label=name)
        if mu:
            etas = np.linspace(-0.5, 0.8, 14)
            true = np.array([motion_edges(each, 1, (0.3, 1.9)) for each in etas])
            axes.plot(true[:, 0], etas, color=RED, lw=1.3, ls="--", label="the motion itself")
            axes.plot(true[:, 1], etas, color=RED, lw=1.3, ls="--")
        axes.set(xlim=(0.4, 1.8), ylim=(-1.0, 1.0))
        label(axes, "λ² = m B₀ / (C ω₀²)" if mu else "", f"{MODELS[mu]}: 3 (A - B) / C")
    return figure


ENTRY = Entry(ids=("FIELD-mathieu",), compute=compute, slow=True)
