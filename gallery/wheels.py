"""The satellite of WHEEL and its arrays, and figures in space for its entries."""

import math

from matplotlib.figure import Figure

from torquer.report.wheels.pictures import draw_envelope
from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.envelope import Envelope
from torquer.spacecraft.wheel_array.rates import required_momenta, worst_case

#: Like Foton-M4 and Bion-M1: principal moments [kg m^2], limit of a wheel [N m s].
INERTIA = (2600.0, 11100.0, 10900.0)
LIMIT = 18.0
#: The printed angles.
FOUR, SIX = layout.four_sided_pyramid(80.5, 45.5), layout.regular_pyramid(6, 81.1)


def without(axes, lost: int):
    """Axes after the loss of a wheel."""
    return [axis for k, axis in enumerate(axes) if k != lost]


def worst_rate_deg_s(axes) -> float:
    """Rate [deg/s] that is reached about every axis."""
    return math.degrees(worst_case(envelope(axes), INERTIA).rate)


def envelope(axes) -> Envelope:
    """Momentum envelope of these wheels [N m s]."""
    return Envelope([[LIMIT * x for x in axis] for axis in axes])


def needed(rate_deg_s: float):
    """Momenta [N m s] of turns at a rate about all axes."""
    return required_momenta(INERTIA, math.radians(rate_deg_s))


def figure_in_space(title: str, shown, columns: int = 2, frame=None) -> Figure:
    """Envelopes with ellipsoids, None for none, side by side: (words, envelope, ellipsoid).

    `frame`: an envelope to take one scale for all from.
    """
    rows = math.ceil(len(shown) / columns)
    figure = Figure(figsize=(7.2, 3.2 * rows + 0.4), dpi=160, facecolor="white")
    figure.suptitle(title, x=0.012, y=0.985, ha="left", fontsize=12, fontweight="bold")
    width, height = 1.0 / columns, (1.0 - 0.4 / figure.get_figheight()) / rows
    for number, (label, each, ellipsoid) in enumerate(shown):
        left, low = width * (number % columns), height * (rows - 1 - number // columns)
        place = (left, low + 0.03 * height, width, 0.9 * height)
        axes = figure.add_axes(place, projection="3d", computed_zorder=False)
        draw_envelope(axes, each, ellipsoid, frame)
        figure.text(left + 0.015, low + 0.94 * height, label, fontsize=9.5, va="top")
    return figure
