"""What the author of a scenario with a Kalman filter should know."""

from torquer.estimation.kalman_gyro import KalmanGyro
from torquer.scenario.spec import Scenario


def filter_notes(scenario: Scenario) -> list[str]:
    """Notes on filters, one line each."""
    control = scenario.control
    filters = [control.estimator, *control.estimators.values()]
    uneven = control.measure_s > 0.0 and control.actuate_s != control.sample_s
    if not uneven or not any(isinstance(spec, KalmanGyro) for spec in filters):
        return []
    steps = f"{control.sample_s:g} and of {control.actuate_s:g} s"
    return [
        f"a filter with a gyro takes steps of {steps} here: its angle random walk can be right for "
        "only one of these intervals; torquer filter-check shows the effect"
    ]
