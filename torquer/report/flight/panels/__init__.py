"""What the time plots show; drawn by `png` and `interactive`."""

from torquer.report.flight.panels.attitude import angle, attitude_error
from torquer.report.flight.panels.coils import dipole_whole, dipoles
from torquer.report.flight.panels.logs import logged_names, logs
from torquer.report.flight.panels.magnetic_field import field
from torquer.report.flight.panels.modes import with_modes
from torquer.report.flight.panels.motion import (
    body_axes_from_vertical,
    momentum,
    momentum_size,
    pointing,
    rate,
    rate_size,
)
from torquer.report.flight.panels.panel import Panel, Picture, told_panel, told_picture
from torquer.report.flight.panels.reaction_wheels import speeds_or_shares, wheels
from torquer.report.flight.panels.torques import torques
from torquer.report.flight.view import View


def pictures(view: View) -> tuple[Picture, ...]:
    """All pictures over time that apply to the satellite and its laws, below its modes."""
    makers = (
        (attitude_error, view.attitude_error is not None),
        (rate, True),
        (wheels, view.wheels is not None),
        (momentum, True),
        (field, True),
        (dipoles, view.has_coils),
        (torques, bool(view.budget.disturbance)),
        (pointing, True),
        (logs, bool(logged_names(view))),
    )
    return tuple(told_picture(with_modes(view, make(view))) for make, made in makers if made)


def overview(view: View) -> tuple[Panel, Panel, Panel]:
    """The three most informative panels."""
    panels = (told_panel(panel) for panel in _most_informative(view))
    first, second, third = panels
    return first, second, third


def _most_informative(view: View) -> tuple[Panel, Panel, Panel]:
    first = rate_size(view) if view.attitude_error is None else angle(view)
    if view.wheels is not None:
        return first, momentum_size(view), speeds_or_shares(view)
    last = dipole_whole(view) if view.has_coils else body_axes_from_vertical(view)
    return first, momentum_size(view), last
