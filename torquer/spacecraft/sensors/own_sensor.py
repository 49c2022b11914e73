"""A sensor of the user's own: a compiled function, called by its address."""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.user_code import UserCode
from torquer.compile.engine import caller, inlined
from torquer.environment.table import lookup3
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import is_finite, scale
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.disturbance.user import NO_PARAMETERS
from torquer.spacecraft.failures import PlainFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sunlight import sun_and_light

STREAM = 0


class SensorInputs(NamedTuple):
    """What a sensor may feel.

    `t_s`: time since the start; `q_body_to_inertial`, `omega_body_rad_s`: true attitude and rate;
    `b_body_t`: field; `sun_body`: unit vector to the Sun, whatever hides it; `sunlit_fraction`:
    visible part of its disc; `r_inertial_m`: position; `noise`: three normal numbers of the
    standard deviation that the scenario states, new ones for each reading.

        >>> def sun_vector(here):  # a sensor of your own: `spacecraft.own_sensor` names its file
        ...     return tuple(here.sunlit_fraction * part for part in here.sun_body)
        >>> here = torquer.SensorInputs(
        ...     t_s=0.0, q_body_to_inertial=(0.0, 0.0, 0.0, 1.0), omega_body_rad_s=(0.0, 0.0, 0.0),
        ...     b_body_t=(2e-5, 0.0, 0.0), sun_body=(0.0, 0.0, 1.0), sunlit_fraction=0.5,
        ...     r_inertial_m=(7e6, 0.0, 0.0), noise=(0.0, 0.0, 0.0),
        ... )
        >>> sun_vector(here)
        (0.0, 0.0, 0.5)
    """

    t_s: float = 0.0
    q_body_to_inertial: tuple = (0.0, 0.0, 0.0, 1.0)
    omega_body_rad_s: tuple = (0.0, 0.0, 0.0)
    b_body_t: tuple = (0.0, 0.0, 0.0)
    sun_body: tuple = (0.0, 0.0, 0.0)
    sunlit_fraction: float = 0.0
    r_inertial_m: tuple = (0.0, 0.0, 0.0)
    noise: tuple = (0.0, 0.0, 0.0)


class OwnSensorSet(NamedTuple):
    """Constants of the sensor for kernels: address of its function, numbers of its parameters."""

    address: int
    parameters: tuple
    noise: float


#: For kernels: none.
NO_OWN_SENSOR = OwnSensorSet(0, NO_PARAMETERS, 0.0)


def signature():
    """Signature of the compiled function."""
    import numba

    numbers = numba.types.UniTuple(numba.types.float64, 3)
    return numbers(numba.typeof(SensorInputs()), numba.typeof(NO_PARAMETERS))


_call = caller(signature)


@inlined
def own_around(sensor, around):
    """Place, field, direction to the Sun, visible part of it; all inertial."""
    direction, fraction = sun_and_light(around.shadow, around.orbit, around.sun, around.t_s)
    return lookup3(around.orbit, around.t_s), around.b_inertial, direction, fraction


@inlined
def read(sensor, here, sky, noise_sample):
    """What the user's function returns; it remembers whether that was no finite numbers."""
    r, b, direction, fraction = sky
    x = here.motion
    felt = SensorInputs(
        here.t_s,
        x.q,
        x.omega,
        rotate_inverse(x.q, b),
        rotate_inverse(x.q, direction),
        fraction,
        r,
        scale(sensor.noise, noise_sample),
    )
    answer = _call(sensor.address, felt, sensor.parameters)
    here.own[0] = 0.0 if is_finite(answer) else 1.0
    return answer


class OwnSensor(UserCode, Sampled):
    """A sensor of your own: a function `(here, **parameters)` in a Python file.

    `here` is a `torquer.SensorInputs`; the function returns three numbers, which laws, estimators
    and results know as `own_reading`. It is compiled, and keeps nothing in mind.
    """

    sheet: ClassVar = DataSheet(name="own sensor", senses="", unit="1", noise="noise")
    kind: Literal["user"]
    failures: tuple[PlainFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    noise: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the random numbers that its function gets."""
    place = "spacecraft.own_sensor"
    takes = 1
    returns = "a function (here) that compiles and returns three numbers"

    def pack(self) -> OwnSensorSet:
        """Constants for kernels, before the function is compiled."""
        return NO_OWN_SENSOR._replace(noise=self.noise)


DEVICE = Device(
    "own_sensor",
    given="own_reading",
    said="own sensor",
    symbol="own",
    units="1",
    meaning="last reading of the sensor of the user's own",
    spec=OwnSensor,
    absent=NO_OWN_SENSOR,
    need="own_sensor",
    read=read,
    sky=own_around,
    draws=((STREAM, ("noise",)),),
    by_sunlight=lambda sensor: True,
    may_stay=True,
)
