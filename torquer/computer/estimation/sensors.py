"""Estimates without an estimator: attitude sensor and gyro as they read, a law's own, none."""

from typing import ClassVar, Literal

from torquer.base.spec import Spec


class SensorReadings(Spec):
    """The estimate is what attitude sensor and gyro read."""

    kind: Literal["attitude_sensor"] = "attitude_sensor"
    gives: ClassVar = frozenset({"attitude", "rate"})


class LawEstimate(Spec):
    """The estimate is that which a law states with its command; none while no law does."""

    kind: Literal["law"] = "law"
    gives: ClassVar = frozenset({"attitude", "rate"})


class NoEstimator(Spec):
    """Attitude and rate are not known; laws may use sensors' readings only."""

    kind: Literal["none"] = "none"
    gives: ClassVar[frozenset[str]] = frozenset()
