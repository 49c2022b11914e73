"""Estimators, one file each; adding one is one file and its line in `ESTIMATORS`.

>>> torquer.ESTIMATORS["attitude_sensor"]().kind
'attitude_sensor'
"""

from typing import Annotated

from pydantic import Field

from torquer.base.spec import by_kind
from torquer.computer.estimation.estimator import Estimator as Estimator
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.estimation.rate_from_field import RateFromField
from torquer.computer.estimation.sensors import LawEstimate, NoEstimator, SensorReadings
from torquer.computer.estimation.triad import Triad
from torquer.computer.estimation.user import UserEstimator

_Estimators = (
    SensorReadings
    | LawEstimate
    | NoEstimator
    | RateFromField
    | Triad
    | KalmanGyro
    | KalmanDynamics
    | UserEstimator
    | UserEstimator
)

#: Estimators by the kind that a scenario names.
ESTIMATORS = by_kind(_Estimators)

AnyEstimator = Annotated[_Estimators, Field(discriminator="kind")]
