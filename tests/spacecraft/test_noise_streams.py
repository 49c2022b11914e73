"""Each source of random numbers has a stream of its own: two with one would err alike."""

import ast
from pathlib import Path

import torquer.spacecraft
from torquer.spacecraft.failures import FIRST_STREAM
from torquer.spacecraft.sensors.device import MOST_UNITS
from torquer.spacecraft.sensors.devices import FIRST_UNIT_STREAM, MOST_DRAWS, STREAMS

FOLDER = Path(torquer.spacecraft.__file__).parent


def streams_in(path):
    """Numbers by constant that a file calls streams."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign):
            targets = node.targets[0]
            names = targets.elts if isinstance(targets, ast.Tuple) else [targets]
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
            for name, value in zip(names, values, strict=False):
                is_one = isinstance(name, ast.Name) and name.id.endswith("STREAM")
                if is_one and not name.id.startswith("FIRST"):
                    yield f"{path.stem}.{name.id}", ast.literal_eval(ast.unparse(value))


def test_no_two_devices_share_a_stream_and_no_failure_takes_theirs():
    files = [path for path in FOLDER.rglob("*.py") if path.stem != "failures"]
    found = dict(pair for path in files for pair in streams_in(path))
    # that of the coils' errors came later, and must not move those of units
    assert STREAMS <= found.pop("coil_driver.STREAM") < FIRST_STREAM
    after = FIRST_UNIT_STREAM + MOST_DRAWS * MOST_UNITS
    assert sorted(found.values()) == [*range(FIRST_UNIT_STREAM), *range(after, STREAMS)], found
