"""A Kalman filter as users state it: its keys, its memory before the start, what it logs."""

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from torquer.base.computing import by_scenario
from torquer.base.spec import Spec
from torquer.computer.blocks.adapter import flat
from torquer.computer.blocks.block import Axis
from torquer.computer.estimation.channels import Sensing
from torquer.computer.estimation.covariance import CALIBRATION, States
from torquer.computer.estimation.estimator import Estimator
from torquer.computer.estimation.kalman import NOTHING
from torquer.computer.estimation.measurements.star_tracker import PAST
from torquer.computer.estimation.measurements.table import (
    BY_NAME,
    CHANNEL_OF,
    CHANNELS,
    DEVICE_OF,
    UNIT_NUMBERS,
    UNITS_AT,
    WATCHERS,
)
from torquer.computer.estimation.sensor_keys import NOISE_KEYS, SENSOR_LABELS, SensorKeys
from torquer.computer.estimation.starts import UNINFORMED
from torquer.computer.estimation.state_names import state_axes
from torquer.computer.estimation.watch import WATCHED
from torquer.spacecraft.data_sheet import Assumed
from torquer.spacecraft.sensors.device import MOST_UNITS
from torquer.spacecraft.sensors.devices import Flown

#: Standard deviations within which a fixed error lies, as `Filter.gate` has it that a reading does:
#: of three components beyond 5.1 only one in 1e5 is.
SIGMAS = 5.1
#: Keys of errors of the magnetometer that may be states, and which errors.
_MAGNETOMETER_STATES = (
    Assumed("magnetometer_bias_sigma_nt", "magnetometer", "bias", SIGMAS),
    Assumed("magnetometer_scale_sigma", "magnetometer", "scale", SIGMAS),
    Assumed("magnetometer_misalignment_sigma_deg", "magnetometer", "misalignment", SIGMAS),
)
MAGNETOMETER_ERRORS = tuple(each.key for each in _MAGNETOMETER_STATES)


#: Constants of a unit that is not measured; one row where there are no several devices of a kind.
_NO_UNIT = (-1.0, *(0.0,) * (UNIT_NUMBERS - 1))
NO_UNITS = (_NO_UNIT,)


def filter_memory(n: int, units: tuple = NO_UNITS) -> dict:
    """Memory of a filter of n states that has not started; `states`: those beyond the attitude.

    `units`: constants of several devices of a kind, which kernels index.
    """
    row = (0.0,) * n
    return {
        "t_s": -math.inf,
        "read_s": (-math.inf,) * CHANNELS,
        "q": (math.nan, *NOTHING),
        "states": row[3:],
        "covariance": (row,) * n,
        "gain": (row,) * 3,
        "correction": row,
        **{
            f"innovation_{name}": NOTHING if each.channels == 1 else (math.nan,) * each.channels
            for name, each in BY_NAME.items()
        },
        "innovation_cell": NOTHING,
        "innovation_units": (NOTHING,) * MOST_UNITS,
        "unit_constants": units,
        "by_units": tuple(
            float(any(u[0] == channel for u in units)) for channel in CHANNEL_OF.values()
        ),
        "earthlight": (0.0, 0.0, 0.0),
        "watched": (((-math.inf,) * WATCHED,) * 2,) * WATCHERS,
        "rotation": (0.0, 0.0, 0.0, 1.0),
        "past": ((-math.inf, 0.0, 0.0, 0.0, 1.0),) * PAST,
        "past_next": 0.0,
        "missed": (0.0,) * CHANNELS,
        "rate_error": 0.0,
        "doubted_s": (-math.inf, -math.inf),
        "unrest": 0.0,
        "rate_corrected": 0.0,
        "rejected_in_a_row": (0.0,) * CHANNELS,
        "isolated": (0.0,) * CHANNELS,
        "rejected": 0.0,
        "starts": 0.0,
        "not_started": 0.0,
    }


#: What filters log, besides the innovations of their sensors and which of them are isolated.
#: Parameters that say what is estimated and of what.
_FIXED = frozenset({"prior", "sensing"})
LOG = dict.fromkeys(("rejected", "starts", "not_started"), "1")


def describe_keys(spec: type[Spec]) -> str:
    """A spec's docstring after its first line, to be appended to those of its kinds."""
    return "\n\n" + (spec.__doc__ or "").partition("\n\n")[2]


class Filter(SensorKeys):
    """A Kalman filter; noise as the filter believes it.

    The filter starts from a reading of the star tracker or by TRIAD from the latest directions,
    unless their angle is not that of the models. It starts again where the standard deviation of
    the attitude, that of all axes together, exceeds `lost_sigma_deg`. With the magnetometer alone
    it starts with several hypotheses about the turn around the field, and states their spread until
    they agree; with another direction alone it needs an attitude from another estimator. Where
    other estimators have worked before it, in other modes, it takes over an attitude that is not
    older than `longest_gap_s` and better than its own; after a longer gap it starts again. An
    attitude that has become more uncertain than any is unknown, and the filter starts as at first.

    Sensors and motion are watched. A sensor is isolated while its readings stay though the body
    turns, while its field is not as large as that of the model, or while it sees the Sun in the
    umbra. Where readings turn otherwise than the propagated motion, the rate becomes uncertain.
    After `most_rejected` readings of a sensor rejected one after another the filter starts again by
    TRIAD, or isolates the sensor if others agree with the filter. Otherwise it turns its attitude
    to fit the readings and states that it does not know it.
    """

    gives: ClassVar = frozenset({"attitude", "rate"})
    #: Keys of errors of devices that are states, or may be.
    states_of_devices: ClassVar[tuple[Assumed, ...]] = _MAGNETOMETER_STATES
    #: Whether a gyro shows the motion.
    has_gyro: ClassVar[bool] = False
    #: The kernel, and what it remembers beyond `filter_memory`.
    kernel: ClassVar[Callable]
    remembers: ClassVar[dict] = {}
    #: The kernel for the magnetometer alone, and what makes its further memory for n states.
    by_field: ClassVar[tuple[Callable, Callable[[int], dict]]]
    magnetometer_bias_sigma_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Estimate the magnetometer's bias, too, with this standard deviation about zero at the start;
    left out: no bias.
    """
    magnetometer_scale_sigma: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Relative standard deviation of the magnetometer's scale factors, as a further state of the
    filter; left out: no scale errors.
    """
    magnetometer_misalignment_sigma_deg: Annotated[float, Field(gt=0.0, lt=30.0)] | None = None
    """Standard deviation of the magnetometer's misalignment about each axis, as a further state of
    the filter; left out: no misalignment.
    """
    calibration: Literal["estimated", "considered"] = "estimated"
    """What the filter does with scale factors and misalignments that have a standard deviation:
    estimates them, or only considers what they do to the accuracy of all else. Considering suits
    errors that the readings do not determine.
    """
    gate: float = Field(default=1e-5, gt=0.0, lt=1.0)
    """Probability of rejecting a reading although filter and reading are sound."""
    lost_sigma_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    """Standard deviation of the attitude, of all axes together, above which the filter starts
    again.
    """
    most_rejected: int = Field(default=30, ge=1)
    """Number of readings of a sensor rejected one after another, after which the filter starts
    again or isolates the sensor.
    """
    longest_gap_s: float = Field(default=10.0, gt=0.0)
    """Age up to which the filter takes over another estimator's attitude, or its own after a pause.
    """
    unit_noise: dict[str, Annotated[float, Field(gt=0.0)]] = Field(default_factory=dict)
    """Noise of single ones of several devices of a kind by their names, in the unit of the kind's
    noise; left out: that of the kind.
    """
    record_covariance: bool = False
    """Record the states beyond the attitude, and the covariance matrix of all errors."""

    @property
    def assumes(self) -> tuple[Assumed, ...]:
        """What the keys say of devices: of the noise of sensors, and of errors that are states."""
        states = (each for each in self.states_of_devices if getattr(self, each.key) is not None)
        return (*super().assumes, *states)

    @model_validator(mode="after")
    def _errors_of_the_magnetometer(self):
        for key in MAGNETOMETER_ERRORS:
            if "magnetometer" not in self.sensors and getattr(self, key) is not None:
                raise ValueError(
                    f"{key}: must be left out without the magnetometer among the sensors; "
                    f"received {getattr(self, key):g}"
                )
        return self

    @model_validator(mode="after")
    def _something_to_consider(self):
        if self.calibration == "considered" and not self.considered_states:
            raise ValueError(
                "calibration: must be left out without a standard deviation of scale factors or "
                "misalignments, which the filter would consider; received 'considered'"
            )
        return self

    def first_considered(self) -> float:
        """First row of the states that are only considered; 0 for none."""
        count = self.considered_states
        return 3.0 * (len(self.initial_variances()) - count) if count else 0.0

    @property
    def considered_states(self) -> int:
        """Number of states (three components each) that are considered, not estimated."""
        if self.calibration == "estimated":
            return 0
        return len(set(CALIBRATION) & set(self.initial_variances()))

    def prior(self, **others: float) -> States:
        """Variances of the states at the start; `others`: of those that filters do not share."""
        bias_t = 1e-9 * (self.magnetometer_bias_sigma_nt or 0.0)
        misalignment = math.radians(self.magnetometer_misalignment_sigma_deg or 0.0)
        return States(
            UNINFORMED,
            magnetometer_bias=bias_t**2,
            magnetometer_scale=(self.magnetometer_scale_sigma or 0.0) ** 2,
            magnetometer_misalignment=misalignment**2,
            **others,
        )

    def variances(self) -> States:
        """Variances of all states at the start, 0 for those that the filter does not have."""
        raise NotImplementedError

    def sensing(self, units: Sequence[Flown] = ()) -> Sensing:
        """Noise of the sensors and limits of the filter for the kernels."""
        last = UNITS_AT + len(units) if units else self.after_last()
        from scipy.special import chdtri  # a third of a second of importing

        return Sensing(
            *(each.constants(self) for each in BY_NAME.values()),
            float(last),
            float(chdtri(1, self.gate)),
            float(chdtri(2, self.gate)),
            float(chdtri(3, self.gate)),
            math.radians(self.lost_sigma_deg) ** 2,
            float(self.most_rejected),
            self.longest_gap_s,
            float(self.has_gyro),
            self.first_considered(),
        )

    def constants(self) -> Any:
        """Parameters for the kernel: `prior`, `sensing` and those of the filter's motion."""
        raise NotImplementedError

    def initial_variances(self) -> dict[str, float]:
        """Variance of each component of the filter's states at the start, by the states' names."""
        return {name: v for name, v in self.variances()._asdict().items() if v > 0.0}

    def estimator(self, units: Sequence[Flown] = ()) -> Estimator:
        """The filter, not yet started; `units`: devices of kinds of which a satellite has several.

        Each of them is a measurement of its own, but for magnetometers alone: the filter that
        starts by the field reads what laws read.
        """
        cls = type(self)
        parameters = by_scenario(cls.constants)(self)
        n = 3 * len(by_scenario(cls.initial_variances)(self))
        kernel, units = cls.kernel, self.measured(units)
        memory = filter_memory(n, by_scenario(cls.unit_constants)(self, units)) | cls.remembers
        parameters = parameters._replace(sensing=by_scenario(cls.sensing)(self, units))
        if self.starts_by_field:
            kernel, more = cls.by_field
            # first: a record that begins as another does is a kind of it to Numba, which warns
            memory = more(n) | memory
        logs = self.logs(units)
        return Estimator(
            self.kind, kernel, parameters, memory, logs, self.needs, spec=self, fixed=_FIXED
        )

    @property
    def starts_by_field(self) -> bool:
        """Whether the filter has the magnetometer alone: it starts with several hypotheses."""
        return self.sensors == ("magnetometer",)

    @property
    def needs(self) -> frozenset[str]:
        """Ephemeris, and those sensors used that are not always read."""
        words = {DEVICE_OF[sensor].need for sensor in self.sensors}
        return frozenset({"ephemeris", *words} - {""})

    def measured(self, units: Sequence[Flown]) -> Sequence[Flown]:
        """All units of several devices, if the filter measures with any of them; else none."""
        return units if self.measured_names(units) else ()

    def measured_names(self, units: Sequence[Flown]) -> tuple[str, ...]:
        """Names of those of several devices that are measurements of their own."""
        if self.starts_by_field:
            return ()
        used = {DEVICE_OF[sensor].name for sensor in self.sensors}
        return tuple(each.name for each in units if each.device.name in used)

    def unit_constants(self, units: Sequence[Flown]) -> tuple:
        """Constants of units, a row each: channel of its kind (-1: not measured), its own."""
        rows, names = [], {device.name: name for name, device in DEVICE_OF.items()}
        for each in units:
            name = names.get(each.device.name, "")
            if name not in self.sensors:
                rows.append(_NO_UNIT)
                continue
            measured = BY_NAME[name]
            own = self.unit_noise.get(each.name, getattr(self, measured.noise))
            keys = self.model_copy(update={measured.noise: own})
            numbers = flat(measured.of_unit(keys, each.spec))
            rest = (0.0,) * (UNIT_NUMBERS - 1 - len(numbers))
            rows.append((float(CHANNEL_OF[name]), *map(float, numbers), *rest))
        return (*rows, *(_NO_UNIT,) * (MOST_UNITS - len(rows))) if rows else NO_UNITS

    def with_units(self, units: Sequence[Flown]) -> Self:
        """This filter with one device for several: with the noise that they have together."""
        changed = {}
        for name in self.sensors:
            own = [u for u in self.measured(units) if u.device is DEVICE_OF[name]]
            noise = BY_NAME[name].noise
            given = [self.unit_noise.get(each.name, getattr(self, noise)) for each in own]
            if given:
                changed[noise] = sum(each**-2.0 for each in given) ** -0.5
        return self.model_copy(update=changed)

    def logs(self, units: Sequence[Flown] = ()) -> dict:
        """What is logged: names in the memory, units or axes."""
        labels = (*SENSOR_LABELS, *(each.name for each in units))
        by_field = {"hypotheses": "1"} if self.starts_by_field else {}
        covariance = state_axes(self.initial_variances()) if self.record_covariance else {}
        innovations = {
            f"innovation_{sensor}": "1" for sensor in NOISE_KEYS if sensor in self.sensors
        }
        isolated = {"isolated": (Axis("sensor", labels, ("1",) * len(labels)),)}
        if units:
            names = tuple(each.name for each in units)
            rows = Axis("unit", names, ("1",) * len(names))
            isolated["innovation_units"] = (rows, Axis("axis", tuple("xyz"), ("1",) * 3))
        return innovations | LOG | isolated | by_field | covariance
