"""Names and units of the states of filters, as results have them."""

from collections.abc import Iterable

from torquer.computer.blocks.block import Axis

#: Units of the components of each state; the attitude's is its error, a small rotation.
UNITS = {
    "attitude": "rad",
    "gyro_bias": "rad/s",
    "rate": "rad/s",
    "residual_dipole": "A m^2",
    "magnetometer_bias": "T",
    "magnetometer_scale": "1",
    "magnetometer_misalignment": "rad",
    "gyro_scale": "1",
    "gyro_misalignment": "rad",
}


def state_axis(name: str, states: Iterable[str]) -> Axis:
    """A dimension along the components of states: `gyro_bias_x` and so on."""
    rows = [(f"{state}_{c}", UNITS[state]) for state in states for c in "xyz"]
    return Axis(name, tuple(label for label, _ in rows), tuple(unit for _, unit in rows))


def state_axes(states: Iterable[str]) -> dict[str, tuple[Axis, ...]]:
    """Axes of what a filter with these states, attitude first, keeps in its memory."""
    states = list(states)
    errors = state_axis("error", states), state_axis("other_error", states)
    return {"states": (state_axis("state", states[1:]),), "covariance": errors}
