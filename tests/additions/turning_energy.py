"""Energy of the rotation over time."""

import numpy as np

from torquer.report.common.colours import GREY
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import Picture, log_panel
from torquer.report.flight.view import View


def turning_energy(view: View) -> Picture:
    """Half of the rate times the angular momentum of the body."""
    inertia = np.array(view.scenario.spacecraft.body.inertia_kg_m2)
    tensor = inertia if inertia.ndim == 2 else np.diag(inertia)
    omega = view.values("omega_body")
    energy = 0.5 * np.einsum("ni,ij,nj->n", omega, tensor, omega)
    factor, unit = choose_prefix(energy, "J")
    panel = log_panel(view, "Energy", f"[{unit}]", [("T", factor * energy, GREY, 1.4)])
    return Picture("turning_energy", "Energy of the rotation", "Of the body alone.", (panel,))
