"""Calibration on board: numbers of the ground that correct readings, tachometers and the dipole.

Readings are corrected as they reach the computer, so that estimators, modes, laws and telemetry
have the same ones; the dipole on its way to the coils. Where nothing is calibrated nothing is
computed.
"""

import numpy as np

from torquer.compile.engine import inlined, kernel, records
from torquer.computer.interface import GYRO, MAGNETOMETER, SUN_SENSORS, TACHOMETERS
from torquer.maths.geometry.vec3 import add_scaled, put_vector, read_vector, sub
from torquer.spacecraft.actuators.rotors import rotor_axis
from torquer.spacecraft.wheel_array.layout import MOST_WHEELS

#: Sensors that can be calibrated, by their numbers: each reads a vector in body axes.
CALIBRATED = (MAGNETOMETER, GYRO, SUN_SENSORS)
#: What the ground has sent. `sensors`, `coils`, `wheels`: 1 where any is corrected; `is_on`: which
#: of the sensors; a reading less `bias` [its unit], times `matrix` (row by row), is the corrected
#: one; `dipole`: factor of the commanded dipole by axis; `tachometers`: factor of each wheel's.
CALIBRATION = np.dtype(
    [
        *((name, np.float64) for name in ("sensors", "coils", "wheels")),
        ("is_on", np.float64, (len(CALIBRATED),)),
        ("matrix", np.float64, (len(CALIBRATED), 9)),
        ("bias", np.float64, (len(CALIBRATED), 3)),
        ("dipole", np.float64, (3,)),
        ("tachometers", np.float64, (MOST_WHEELS,)),
    ]
)
NO_BIAS = (0.0, 0.0, 0.0)
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def nothing_calibrated() -> np.ndarray:
    """One record that corrects nothing."""
    made = np.zeros(1, CALIBRATION)
    made["matrix"], made["dipole"], made["tachometers"] = IDENTITY, 1.0, 1.0
    return records(made)


def calibrate_sensor(calibration: np.ndarray, sensor: int, matrix, bias) -> None:
    """Correct the readings of one of `CALIBRATED` by a matrix (9,) and a bias (3,)."""
    c, place = calibration[0], CALIBRATED.index(sensor)
    c["matrix"][place], c["bias"][place] = matrix, bias
    c["is_on"][place] = tuple(matrix) != IDENTITY or tuple(bias) != NO_BIAS
    c["sensors"] = c["is_on"].any()


def calibrate_coils(calibration: np.ndarray, factors) -> None:
    """Multiply the dipole that coils are commanded to by factors (3,) of the body axes."""
    c = calibration[0]
    c["dipole"] = factors
    c["coils"] = np.any(c["dipole"] != 1.0)


def calibrate_tachometers(calibration: np.ndarray, factors) -> None:
    """Multiply what tachometers read by a factor for each wheel (n,)."""
    c = calibration[0]
    c["tachometers"][: len(factors)] = factors
    c["wheels"] = np.any(c["tachometers"] != 1.0)


@kernel
def correct_readings(c, known, fresh):
    """Correct what has just been read; `fresh`: bits of the sensors, by their numbers."""
    for place in range(len(CALIBRATED)):
        sensor = CALIBRATED[place]
        if c.is_on[place] > 0.0 and fresh & (1 << sensor):
            matrix, cells = c.matrix[place], known.readings[sensor]
            x, y, z = sub(read_vector(cells), read_vector(c.bias[place]))
            for k in range(3):
                cells[k] = matrix[3 * k] * x + matrix[3 * k + 1] * y + matrix[3 * k + 2] * z


@kernel
def correct_tachometers(c, known, rotors, momenta):
    """Correct the wheels' momenta (n,) [N m s] as just read, and their vector sum."""
    total = (0.0, 0.0, 0.0)
    for k in range(momenta.shape[0]):
        momenta[k] *= c.tachometers[k]
        total = add_scaled(total, momenta[k], rotor_axis(rotors.rows, k))
    put_vector(known.readings[TACHOMETERS], total)


@inlined
def corrected_dipole(c, dipole):
    """What coils are commanded to for a dipole [A m^2] to come out."""
    return (dipole[0] * c.dipole[0], dipole[1] * c.dipole[1], dipole[2] * c.dipole[2])


@inlined
def expected_dipole(c, commanded):
    """The dipole [A m^2] that comes out of what coils are commanded to."""
    return (commanded[0] / c.dipole[0], commanded[1] / c.dipole[1], commanded[2] / c.dipole[2])
