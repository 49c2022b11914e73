"""What the author of a scenario should know of its export to C, before it is made."""

from torquer.scenario.spec import Scenario
from torquer.simulation.setup.prepare import make_blocks


def export_notes(scenario: Scenario) -> list[str]:
    """A note with the reason where a scenario's computer cannot be exported; else notes of where
    users' kernels may fail in flight.

    Laws and estimators that come with the package can all be exported, and none fails: where there
    is no other, nothing is translated.
    """
    if all(block.is_built_in for block in make_blocks(scenario).all()):
        return []
    from torquer.flight.c99.computer import find_computer, translate_step
    from torquer.flight.c99.export import ENDLESS, by_file
    from torquer.flight.c99.refusal import Refused

    try:
        made = translate_step(find_computer(scenario), is_pruned=False)
    except Refused as refused:
        return [f"cannot be exported as C: {refused}"]
    fails = "in flight a law fails, and commands nothing, where it would raise an error"
    return [
        *(f"{fails}: {place}" for place in by_file(made.program.checks)),
        *(f"in flight {ENDLESS}: {place}" for place in by_file(made.program.loops)),
    ]
