"""Pictures of a magneto-gyroscopic design: wheel, errors, flights, orbits."""

import math

import numpy as np
from matplotlib.figure import Figure, SubFigure

from torquer.design.gyro.answer import GyroDesign
from torquer.design.pointing_flights import PointingFlights
from torquer.report.common.colours import BLUE, GREEN, ORANGE, RED, UNSTABLE
from torquer.report.common.figure import FAINT, INK, legend_at_left, stack_panels
from torquer.theory.magneto_gyro.day import degree_map
from torquer.theory.magneto_gyro.wheel_choice import over_stiffness

#: h shown: beyond 0 to at least this, or this much more than the satellite's.
_LEAST_H, _MORE_H, _WHEELS = 8.0, 2.0, 121
_NEAR_2 = np.linspace(1.9, 2.1, 16)
#: Orbits of the map: closer to each other where the degree falls to zero.
_INCLINATIONS = np.concatenate(
    [np.arange(0, 45, 3), np.arange(45, 136, 10), np.arange(138, 181, 3)]
)
_ALTITUDES = np.geomspace(300.0, 20_000.0, 12)
_LIMITS = ((5.0, ORANGE), (1.0, GREEN))
_ANGLES = (("roll", RED), ("pitch", GREEN), ("yaw", BLUE))


def draw_gyro_design(made: GyroDesign) -> dict[str, Figure]:
    """Pictures of a design by name: flights only if there are some."""
    name = made.case.scenario.name
    figures = {
        "wheel": draw_wheels(made, f"{name}: which wheel?"),
        "errors": draw_errors(made, f"{name}: pointing error by cause"),
        "orbits": _orbits(made, f"{name}: on which orbits?"),
    }
    if made.flights is not None:
        title = f"{name}: from tip-off to pointing" + ": doubtful" * bool(made.verdict.doubts)
        figures["flights"] = draw_flights(made, made.flights, title)
    return figures


def draw_wheels(made: GyroDesign, title: str, on: SubFigure | None = None) -> Figure:
    """Degrees of both stages over h; wheels with which one of them is unstable are shaded."""
    craft = made.case.craft
    h = np.linspace(0.05, max(_LEAST_H, craft.stiffness + _MORE_H), _WHEELS)
    h = np.sort(np.concatenate([h, _NEAR_2]))
    found = over_stiffness(craft, made.first, made.second.weights, h, made.case.along.normal,
                           made.request.form)  # fmt: skip
    figure, (axes,) = stack_panels(title, 1, 4.6, on)
    unstable = (found.first <= 0.0) | ~(found.second > 0.0)
    axes.fill_between(h, 0.0, 1.0, where=unstable, step="mid", transform=axes.get_xaxis_transform(),
                      color=UNSTABLE, lw=0.0, label="a stage unstable")  # fmt: skip
    axes.plot(h, found.second, color=BLUE, lw=1.6, label="stage 2, exact")
    axes.plot(h, found.frozen, color=BLUE, lw=1.1, ls="--", label="stage 2, frozen")
    axes.plot(h, found.first, color=ORANGE, lw=1.4, label="stage 1, exact")
    top = 1.25 * max(np.nanmax(found.first), np.nanmax(found.frozen))
    axes.set_ylim(-0.25 * top, top)
    axes.set_xlim(-0.1, h[-1])
    axes.axhline(0.0, color=INK, lw=0.8)
    marks = ((0.0, "h = 0", FAINT), (2.0, "h = 2", FAINT),
             (craft.stiffness, f"h = {craft.stiffness:.3g}, this wheel", RED))  # fmt: skip
    for row, (place, text, colour) in enumerate(marks):
        axes.axvline(place, color=colour, lw=1.2, ls=(0, (5, 3)))
        at_right = place > 0.5 * h[-1]  # where the text would leave the axes
        axes.annotate(
            text, (place, 0.03 + 0.07 * row), xycoords=axes.get_xaxis_transform(),
            xytext=(-4 if at_right else 4, 0), textcoords="offset points",
            ha="right" if at_right else "left", fontsize=8.5, color=INK,
            bbox={"color": "white", "alpha": 0.85, "pad": 1.0},
        )  # fmt: skip
    axes.set_xlabel("stiffness h\nstage 2: gains made for each wheel with the same weights; "
                    "stage 1: the same gains", fontsize=9)  # fmt: skip
    axes.set_ylabel("degree of stability [1/nu0]", fontsize=10)
    upper = axes.secondary_xaxis("top", functions=(craft.wheel_at, _find_stiffness(craft)))
    upper.set_xlabel("momentum of the wheel [N m s]", fontsize=9)
    upper.tick_params(labelsize=8.5, color=FAINT)
    axes.legend(loc="upper right", fontsize=8.5, frameon=True, framealpha=0.9, edgecolor="none",
                ncols=2)  # fmt: skip
    return figure


def _find_stiffness(craft):
    return lambda wheel: wheel / craft.momentum_unit + craft.pitch_inertia - 2.0


def draw_errors(made: GyroDesign, title: str, on: SubFigure | None = None) -> Figure:
    """Root mean squares of roll, pitch and yaw by cause, and of all together."""
    causes = {**made.errors, "together": np.sqrt(sum(x**2 for x in made.errors.values()))}
    shown = {name: x for name, x in causes.items() if np.any(x > 0.0)} or causes
    figure, (axes,) = stack_panels(title, 1, 3.6, on)
    width, places = 0.26, np.arange(len(shown))
    for number, (name, colour) in enumerate(_ANGLES):
        values = [x[number] for x in shown.values()]
        bars = axes.bar(places + (number - 1) * width, values, 0.92 * width, color=colour,
                        label=name)  # fmt: skip
        axes.bar_label(bars, [f"{x:.2g}" for x in values], fontsize=8, padding=1.5)
    axes.margins(y=0.12)
    axes.set_ylim(bottom=0.0)
    axes.set_xticks(places, [*shown])
    axes.set_ylabel("RMS error [deg]", fontsize=10)
    axes.grid(False, axis="x")
    legend_at_left(axes, 3)
    return figure


def draw_flights(
    made: GyroDesign, flights: PointingFlights, title: str, on: SubFigure | None = None
) -> Figure:
    """Attitude error of each release over the orbits, with the times by theory."""
    period_s = made.case.scenario.orbit.period_s
    figure, (axes,) = stack_panels(title, 1, 4.2, on)
    orbits = flights.t_s / period_s
    least = max(1e-3, 0.1 * float(np.median(flights.error_deg[:, -1])))
    for error in flights.error_deg:
        axes.semilogy(orbits, np.maximum(error, least), color=BLUE, lw=0.8, alpha=0.7)
    count = len(flights.error_deg)
    axes.plot([], [], color=BLUE, label="1 release" if count == 1 else f"{count} releases")
    for limit, colour in _LIMITS:
        axes.axhline(limit, color=colour, lw=1.3, label=f"{limit:g} deg")
        at = made.time.below(math.radians(limit)) / period_s
        axes.plot([at], [limit], "o", color=colour, mec=INK, ms=7, zorder=5)
    axes.plot([], [], "o", color="white", mec=INK, ms=7, label="theory's mean time")
    axes.set_xlim(0.0, orbits[-1])
    axes.set_ylim(0.9 * least, 300.0)
    axes.set_xlabel("orbits", fontsize=10)
    axes.set_ylabel("attitude error [deg]", fontsize=10)
    legend_at_left(axes, 4)
    return figure


def _orbits(made: GyroDesign, title: str) -> Figure:
    """Degree over a day of the designed loop over inclination and altitude."""
    case = made.case
    inclinations = np.unique([*_INCLINATIONS, case.inclination_deg])
    altitudes = np.unique([*_ALTITUDES, case.altitude_km])
    grid = inclinations, altitudes, degree_map(made.loop, inclinations, altitudes)
    figure, (axes,) = stack_panels(title, 1, 4.6)
    axes.grid(False)
    axes.contourf(*grid, levels=[-np.inf, 0.0], colors=[UNSTABLE])
    levels = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5]
    lines = axes.contour(*grid, levels=levels, colors=INK,
                         linewidths=1.0)  # fmt: skip
    axes.contour(*grid, levels=[0.0], colors=RED, linewidths=1.2)
    axes.clabel(lines, fontsize=8.5, fmt="%g")
    axes.fill_between([], [], color=UNSTABLE, label="unstable")
    axes.plot([], [], color=INK, label="degree over a day [1/nu0], same gains and wheel")
    axes.plot([case.inclination_deg], [case.altitude_km], "o", color=BLUE, ms=7, clip_on=False,
              label="this orbit")  # fmt: skip
    axes.set_yscale("log")
    axes.set_yticks(ticks := [300, 500, 1000, 2000, 5000, 10_000, 20_000], [str(x) for x in ticks])
    axes.minorticks_off()
    axes.set_xticks(np.arange(0, 181, 30))
    axes.set_xlabel("inclination [deg]", fontsize=10)
    axes.set_ylabel("altitude [km]", fontsize=10)
    legend_at_left(axes, 3)
    return figure
