"""Whether a scenario can be flown: its laws, modes and models, and the room that a run needs."""

from pathlib import Path

from torquer.computer.computer import Blocks
from torquer.scenario.held import check_judged
from torquer.scenario.load import check_orbit_environment
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.own_functions import own_sensor, own_torques
from torquer.simulation.setup.prepare import make_blocks, modes_for
from torquer.simulation.setup.size import Size, check_disk, check_memory, estimate_size


def checked_size(scenario: Scenario, blocks: Blocks | None = None) -> Size:
    """The size of a run; `ValueError` for a scenario that is unusable or does not fit the machine.

    checked_size(torquer.load_scenario("my_satellite.toml")).computing_s

    `blocks`: those of `check_usable`, if that has been called.
    """
    blocks = check_usable(scenario) if blocks is None else blocks
    size = estimate_size(scenario, blocks.compiled)
    check_memory(size, to_file=True)
    check_disk(size, Path())
    return size


def check_usable(scenario: Scenario) -> Blocks:
    """Laws and estimators of a scenario; `ValueError` for what is unusable.

    That is limits, laws, modes, environment, and the torques and the sensor of the user's own.
    """
    check_judged(scenario.control, scenario.mission)
    blocks = make_blocks(scenario)
    for block in blocks.all():
        block.pack()
    modes_for(scenario, blocks)
    check_orbit_environment(scenario)
    own_torques(scenario)
    own_sensor(scenario)
    return blocks
