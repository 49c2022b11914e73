"""Pictures of the magneto-gyroscopic system: frozen models next to the exact ones."""

import numpy as np

from torquer.report.common.colours import BLUE, GREEN, ORANGE, RED, UNSTABLE, curve_colour
from torquer.report.common.figure import INK, legend_at_left, stack_panels
from torquer.theory.magneto_gyro import comparison
from torquer.theory.magneto_gyro.accuracy import covariances, follow_revolution
from torquer.theory.magneto_gyro.comparison import Degrees
from torquer.theory.magneto_gyro.models import GyroModelCase, GyroModels
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop

_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7)
#: Angles by their name, with the place of each in arrays and its colour.
ANGLES = (("roll", 0, BLUE), ("pitch", 1, GREEN), ("yaw", 2, RED))


def region(title: str, angle_gains, rate_gains, degrees: Degrees, here=None):
    """Figure: degrees `[rate gain, angle gain]` of stage 1 over both gains, logarithmic axes;
    `here`: a pair of gains to be marked."""
    figure, (axes,) = stack_panels(title, 1, 4.6)
    axes.grid(False)
    exact = np.nan_to_num(degrees.exact, nan=-1.0)
    axes.contourf(angle_gains, rate_gains, exact, levels=[-np.inf, 0.0], colors=[UNSTABLE])
    frozen = {"colors": BLUE, "linestyles": "dashed"}
    axes.contour(angle_gains, rate_gains, degrees.frozen, levels=_LEVELS, linewidths=0.8, **frozen)
    axes.contour(angle_gains, rate_gains, degrees.frozen, levels=[0.0], linewidths=2.0, **frozen)
    if exact.max() > _LEVELS[0]:
        lines = axes.contour(
            angle_gains, rate_gains, exact, levels=_LEVELS, colors=INK, linewidths=1.1
        )
        for text in axes.clabel(lines, _LEVELS[1:], fontsize=9, fmt="%g", inline=False):
            text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.6})
    axes.fill_between([], [], color=UNSTABLE, label="exact: unstable")
    axes.plot([], [], color=INK, label="exact")
    axes.plot([], [], color=BLUE, ls="--", label="frozen")
    axes.plot([], [], color=BLUE, ls="--", lw=2.0, label="frozen: 0")
    if here is not None:
        axes.plot(*here, "o", color=RED, ms=7, label="chosen")
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("K/(J ν₀²)", fontsize=10)
    axes.set_ylabel("N/(J ν₀)", fontsize=10)
    legend_at_left(axes, 5, 9.5)
    return figure


def over(title: str, x, name: str, curves, marks=(), lowest: float = -0.3):
    """Figure: degrees over a parameter. `curves`: (label, `Degrees`), each frozen and exact;
    `marks`: values of the parameter with their words."""
    figure, (axes,) = stack_panels(title, 1, 4.0)
    for (label, degrees), colour in zip(curves, (RED, BLUE, ORANGE, GREEN), strict=False):
        known = {"color": colour, "lw": 1.6}
        axes.plot(x, np.maximum(degrees.exact, 2.0 * lowest), label=f"{label}exact", **known)
        axes.plot(
            x, np.maximum(degrees.frozen, 2.0 * lowest), ls="--", label=f"{label}frozen", **known
        )
    axes.axhline(0.0, color=INK, lw=0.8)
    for value, words in marks:
        axes.axvline(value, color="#767676", lw=0.9, ls=":")
        axes.annotate(words, (value, 1.0), xycoords=("data", "axes fraction"), fontsize=9,
                      xytext=(3, -10), textcoords="offset points", color="#555555")  # fmt: skip
    axes.set_ylim(bottom=max(lowest, axes.get_ylim()[0]))
    axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(name, fontsize=10)
    axes.set_ylabel("degree of stability [ν₀]", fontsize=10)
    legend_at_left(axes, 4, 9.5)
    return figure


def roots(title: str, factors, followed, name: str, lowest: float = -4.0, highest: float = 0.4):
    """Figure: root locus `[points, n]` of a frozen model; the roots at factor 1 are marked."""
    figure, (axes,) = stack_panels(title, 1, 4.6)
    axes.axvspan(0.0, highest, color=UNSTABLE, lw=0)
    one = int(np.argmin(np.abs(np.log(factors))))
    shown = [k for k in range(followed.shape[1]) if followed[one, k].real > lowest]
    for i, k in enumerate(shown):
        path = followed[:, k]
        axes.plot(path.real, path.imag, color=curve_colour(i), lw=1.2)
        axes.plot(path[0].real, path[0].imag, "x", color=INK, ms=5)
        axes.plot(path[one].real, path[one].imag, "o", color=curve_colour(i), ms=5)
    axes.plot([], [], "x", color=INK, label=f"{name} {factors[0]:g}")
    axes.plot([], [], "o", color=INK, label=f"{name} 1")
    axes.fill_between([], [], color=UNSTABLE, label="unstable")
    axes.set_xlim(lowest, highest)
    tops = [np.abs(followed[:, k].imag[followed[:, k].real > lowest]).max() for k in shown]
    axes.set_ylim(-0.02 * max(tops), 1.05 * max(tops))
    axes.set_xlabel("real part [ν₀]", fontsize=10)
    axes.set_ylabel("imaginary part [ν₀]", fontsize=10)
    legend_at_left(axes, 3, 9.5)
    return figure


def errors(title: str, tau, frozen_deg, exact_deg):
    """Figure: standard deviations [deg] `[n, 3]` of the angles along the orbit, both models."""
    figure, (axes,) = stack_panels(title, 1, 3.9)
    for name, k, colour in ANGLES:
        axes.plot(np.degrees(tau), exact_deg[:, k], color=colour, lw=1.6, label=f"{name}, exact")
        axes.plot(np.degrees(tau), frozen_deg[:, k], color=colour, lw=1.1, ls="--",
                  label=f"{name}, frozen")  # fmt: skip
    axes.set_xlim(0.0, 360.0)
    axes.set_xticks(np.arange(0.0, 361.0, 60.0))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("from the ascending magnetic node [deg]", fontsize=10)
    axes.set_ylabel("standard deviation [deg]", fontsize=10)
    legend_at_left(axes, 3, 9)
    return figure


def dipole_response(title: str, frequencies, panels):
    """Figure: amplitudes over the frequency of a torque. `panels`: (words, with, without the
    compensator), amplitudes `[n, 3]` of phi, theta, chi per J nu0^2/A."""
    figure, axes = stack_panels(title, len(panels), 6.0, sharex=True)
    for each, (words, amplitudes, without) in zip(axes, panels, strict=True):
        for name, k, colour in (("φ", 0, BLUE), ("θ", 1, GREEN), ("χ", 2, RED)):
            if amplitudes[:, k].max() > 1e-12:
                each.plot(frequencies, amplitudes[:, k], color=colour, lw=1.6, label=name)
                each.plot(frequencies, without[:, k], color=colour, lw=1.1, ls="--",
                          label=f"{name}, no compensator")  # fmt: skip
        each.set(xscale="log", yscale="log")
        each.set_ylabel(f"dipole {words}", fontsize=9.5)
        each.set_ylim(1e-6, 1.0)
        legend_at_left(each, 4, 9)
    axes[-1].set_xlabel("frequency in the turning axes [ν₀]", fontsize=10)
    axes[-1].set_xlim(frequencies[0], frequencies[-1])
    return figure


# ------------------------------------------------------------ of a scenario

#: Gains in a chart, factors of the gains in root loci, values of h.
_GRID = 41
_FACTORS = np.geomspace(0.1, 10.0, 81)
_STIFFNESS = np.linspace(-1.0, 10.0, 111)


def draw_gyro_models(models: GyroModels) -> dict:
    """Figures by name of the models of a scenario: stability, roots, errors, answer to a dipole.

    ValueError for models without a scenario.
    """
    case = models.case
    if case is None:
        raise ValueError("models: must be of a scenario, whose numbers are drawn; received none")
    figures = {12: _stage_1, 15: _stage_2}
    return {k: v for order in models.symbols for k, v in figures[order](case).items()}


def _stage_1(case: GyroModelCase) -> dict:
    gains = np.geomspace(0.3, 300.0, _GRID)
    k, n = np.meshgrid(gains, gains)
    points = case.first._replace(angle_gain=k, rate_gain=n)
    degrees = comparison.stage_1_degrees(case.craft, points, normal=case.along.normal)
    title = f"Stage 1: degree of stability per 1/ν₀, h = {case.craft.stiffness:.3g}"
    return {
        "stage_1_gains": region(title, gains, gains, degrees, case.first[:2]),
        "stage_1_h": _over_h(case, 12, "Stage 1: degree of stability over h"),
        "stage_1_roots": _roots(case, 12, "Stage 1: roots of the frozen model"),
    }


def _stage_2(case: GyroModelCase) -> dict:
    found = {
        "stage_2_h": _over_h(case, 15, "Stage 2: degree of stability over h, the gains kept"),
        "stage_2_roots": _roots(case, 15, "Stage 2: roots of the frozen model"),
        "stage_2_dipole": _dipole(case),
    }
    if case.intensity > 0.0 and min(*case.degrees(15)) > 0.0:
        found["stage_2_noise"] = _noise(case)
    return found


def _over_h(case: GyroModelCase, order: int, title: str):
    crafts = [case.craft.with_wheel(case.craft.wheel_at(h)) for h in _STIFFNESS]
    curves = [("", case.degrees(order, crafts))]
    marks = ((0.0, "0"), (2.0, "2"), (case.craft.stiffness, "here"))
    return over(title, _STIFFNESS, "stiffness h", curves, marks)


def _roots(case: GyroModelCase, order: int, title: str):
    followed = comparison.locus([case.frozen(order, factor) for factor in _FACTORS])
    return roots(title, _FACTORS, followed, "gains of angles and rates times")


def _dipole(case: GyroModelCase):
    frequencies = np.geomspace(0.01, 10.0, 400)
    craft, b = case.craft.gyrostat, case.along.normal
    bare = case.gains._replace(e1=0.0, e2=0.0, e3=0.0)
    panels = [
        (words, *(comparison.dipole_response(gains, craft, frequencies, torque, b)
                  for gains in (case.gains, bare)))
        for words, torque in comparison.dipole_torque(frequencies, b).items()
    ]  # fmt: skip
    return dipole_response("Stage 2: angles per dipole", frequencies, panels)


def _noise(case: GyroModelCase):
    noise = [0.0] * 3 + [case.intensity] * 3
    craft, b = case.craft, case.along.normal
    loop = stage_2_loop(craft.satellite(), craft.gyrostat, case.gains, normal=b, form=case.form)
    exact = np.sqrt(np.einsum("nii->ni", covariances(follow_revolution(loop), noise))[:, :3])
    tau = np.linspace(0.0, 2.0 * np.pi, len(exact), endpoint=False)
    frozen = comparison.frozen_covariance(case.gains, craft.gyrostat, noise, b)
    title = "Stage 2: error under the noise of the magnetometer"
    shown = comparison.frozen_error(frozen, tau)
    return errors(title, tau, np.degrees(shown), np.degrees(exact))
