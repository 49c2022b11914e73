"""What a computer knows as the record that the loop holds, from the inputs as users write them."""

import numpy as np

from torquer.compile.engine import records
from torquer.computer.blocks.adapter import flat
from torquer.computer.interface import PLACES, SENSORS, nothing_known
from torquer.spacecraft.sensors.devices import DEVICES


def record_of(inputs):
    """The record as kernels see it."""
    known = nothing_known()
    put_known(known, inputs)
    return records(known)[0]


def put_known(known, inputs) -> None:
    """Fill a record of one row, as `nothing_known` gives it, from `torquer.Inputs`."""
    numbers, count = known.view(np.float64), len(SENSORS)
    known["t_s"], known["gyro_units"] = inputs.t_s, inputs.gyro_units
    numbers[PLACES["coils_x"].start : PLACES["readings"].start] = inputs.coil_dipole_body_a_m2
    for number, device in enumerate(DEVICES):
        known["readings"][0, number, : device.count] = getattr(inputs, device.given)
    units = np.array(inputs.units)
    known["readings"][0, count:], known["read_s"][0, count:] = units[:, 1:], units[:, 0]
    known["read_s"][0, :count] = inputs.read_at
    # estimate, which of the devices it isolates, and ephemeris stand there in the order of inputs
    rest = [*flat(inputs.estimate), *flat(inputs.ephemeris)]
    numbers[PLACES["estimate_s"].start :] = rest
