"""Estimators, one file each; adding one is one file and its line in `ESTIMATORS`."""

from typing import Annotated, Union

from pydantic import Field

from torquer.computer.estimation.estimator import Estimator as Estimator
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.estimation.rate_from_field import RateFromField
from torquer.computer.estimation.sensors import LawEstimate, NoEstimator, SensorReadings
from torquer.computer.estimation.triad import Triad

#: Estimators by the kind that a scenario names.
ESTIMATORS = {
    "attitude_sensor": SensorReadings,
    "law": LawEstimate,
    "none": NoEstimator,
    "rate_from_field": RateFromField,
    "triad": Triad,
    "kalman_gyro": KalmanGyro,
    "kalman_dynamics": KalmanDynamics,
}

AnyEstimator = Annotated[Union[tuple(ESTIMATORS.values())], Field(discriminator="kind")]  # noqa: UP007
