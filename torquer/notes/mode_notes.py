"""What the author of a mode table should know before the run."""

from torquer.control.modes.check import findings
from torquer.scenario.spec import Scenario


def mode_notes(scenario: Scenario) -> list[str]:
    """Faults that the checker finds in the modes, one line each."""
    modes = scenario.control.named().modes
    found = findings(modes) if modes else []
    return [f"modes: {finding.message}" for finding in found if finding.is_fault]
