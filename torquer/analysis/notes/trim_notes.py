"""What the author of a scenario with the law `dipole_trim` should know before the run."""

from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.computer.laws.dipole_trim import FILTERS_IN_TIME, DipoleTrim
from torquer.scenario.spec import Scenario

#: Part by which the time with coils on may differ from what the law knows: as much is not trimmed.
_KNOWN = 0.02


def trim_notes(scenario: Scenario) -> list[str]:
    """Notes on every law of this kind, one line each."""
    checks = {"its cycle": _cycle_notes, "what else acts": _body_notes}
    return [*notes_on_laws(scenario, checks)]


def _cycle_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    law, control = use.law, scenario.control
    if not isinstance(law, DipoleTrim):
        return
    duty, least_s = control.coil_duty, FILTERS_IN_TIME * control.longest_hold_s
    if abs(duty - law.coil_duty) > _KNOWN * duty:
        yield (
            f"the coils are on for {100.0 * duty:.3g} % of the time, and coil_duty of the law is "
            f"{law.coil_duty:g}: it trims {100.0 * duty / law.coil_duty:.3g} % of the dipole"
        )
    if law.time_constant_s < least_s:
        yield (
            f"time_constant_s of {law.time_constant_s:g} s is below {least_s:g} s, "
            f"{FILTERS_IN_TIME:g} times the longest interval between control steps: the law takes "
            "every interval for a gap, and estimates nothing"
        )


def _body_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Wheels, whose torque the law does not know; a limit that the coils or the dipole exceed."""
    law, craft = use.law, scenario.spacecraft
    if not isinstance(law, DipoleTrim):
        return
    if craft.wheels is not None:
        yield "dipole_trim does not know the torques of the wheels, and takes them for a dipole's"
    if craft.coils is None:
        return
    residual, least = craft.coils.residual_dipole_a_m2, float(craft.coils.limits_a_m2().min())
    if float(np.linalg.norm(residual)) > law.greatest_dipole_a_m2:
        yield (
            f"greatest_dipole_a_m2 of {law.greatest_dipole_a_m2:g} A m^2 is less than the "
            f"residual dipole, {np.linalg.norm(residual):.3g} A m^2: the rest is not trimmed"
        )
    if law.greatest_dipole_a_m2 > law.coil_duty * least:
        yield (
            f"greatest_dipole_a_m2 of {law.greatest_dipole_a_m2:g} A m^2 is more than a coil "
            f"gives in the mean, {law.coil_duty * least:.3g} A m^2"
        )
