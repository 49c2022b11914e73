"""WHEEL (4.1) and the end of section 4: the greatest angular acceleration about any axis.

The text says that eps_max follows as omega_max does, with semi-axes I_i eps_max/m_max, m_max the
greatest torque of a wheel; it prints no torque and no acceleration. Computed for 1 N m per wheel,
by the envelope of torques, and against a search over axes.
"""

import math

import numpy as np

from gallery.drawing import BLUE, ORANGE, label, new_figure
from gallery.entry import Answer, Entry, consistent, lost, within
from gallery.wheels import FOUR, INERTIA, LIMIT, SIX, envelope, without
from torquer.spacecraft.wheel_array.envelope import Envelope
from torquer.spacecraft.wheel_array.rates import rate_about, semi_axes, worst_case

TORQUE_N_M = 1.0


def torques(axes) -> Envelope:
    """Envelope of the torques of these wheels [N m]."""
    return Envelope([[TORQUE_N_M * x for x in axis] for axis in axes])


def acceleration(axes) -> float:
    """Angular acceleration [rad/s^2] that is reached about every axis."""
    return float(worst_case(torques(axes), INERTIA).rate)


def searched(axes) -> float:
    """The least, over many axes, of the torque in reach along I e, by its share of the faces."""
    directions = np.random.default_rng(2).normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return float(rate_about(torques(axes), INERTIA, directions).min())


def compute() -> Answer:
    """eps_max of four and six wheels, whole and after the worst loss."""
    arrays = {"four wheels": FOUR, "six wheels": SIX}
    found = {name: acceleration(axes) for name, axes in arrays.items()}
    speeds = {name: float(worst_case(envelope(axes), INERTIA).rate)
              for name, axes in arrays.items()}  # fmt: skip
    same = [found[n] / speeds[n] * LIMIT / TORQUE_N_M for n in arrays]
    lengths = semi_axes(INERTIA, found["four wheels"], TORQUE_N_M)
    share = np.array(sorted(INERTIA)) * found["four wheels"] / TORQUE_N_M
    lost_one = {name: min(acceleration(without(axes, k)) for k in range(len(axes)))
                for name, axes in arrays.items()}  # fmt: skip
    checks = (
        within("eps_max over omega_max, times h_max/m_max, both arrays: off 1",
               "formula (4.1) in the same way", np.abs(np.array(same) - 1.0).max(), high=1e-12),
        within("semi-axes over I_i eps_max/m_max, off 1", "l_i = I_i eps_max/m_max",
               np.abs(lengths / share - 1.0).max(), high=1e-12),
        *(consistent(within(f"{name}: least over 20 000 axes, over eps_max", "about any axis",
                            searched(axes) / found[name], 1.0 - 1e-9, 1.01))
          for name, axes in arrays.items()),
        *(lost(f"{name}: eps_max at 1 N m per wheel", math.degrees(value), "deg/s^2")
          for name, value in found.items()),
        *(lost(f"{name}, the worst one lost", math.degrees(value), "deg/s^2")
          for name, value in lost_one.items()),
    )  # fmt: skip
    note = (
        "No acceleration is printed, nor the torque of a wheel: numbers are for 1 N m, and "
        "proportional to it. What is confirmed is that (4.1) serves both."
    )
    return Answer(checks, {"": picture(arrays, found)}, note)


def picture(arrays, found):
    """Acceleration about axes in the plane of x1 and x3."""
    figure, (axes,) = new_figure("Acceleration at 1 N m per wheel (WHEEL section 4)", height=3.8)
    angle = np.linspace(0.0, 180.0, 721)
    around = np.stack([np.cos(np.radians(angle)), 0.0 * angle, np.sin(np.radians(angle))], axis=1)
    for colour, (name, each) in zip((BLUE, ORANGE), arrays.items(), strict=True):
        rates = np.degrees(rate_about(torques(each), INERTIA, around))
        axes.plot(angle, rates, color=colour, lw=1.3, label=name)
        axes.axhline(math.degrees(found[name]), color=colour, lw=0.9, ls=(0, (5, 3)), zorder=1.5)
    axes.set(xlim=(0.0, 180.0), ylim=(0.0, None), xticks=range(0, 181, 30))
    label(
        axes,
        "axis from x₁ towards x₃ [deg]; dashed: eps_max, about any axis",
        "acceleration [deg/s²]",
    )
    return figure


ENTRY = Entry(ids=("WHEEL-4.1",), compute=compute)
