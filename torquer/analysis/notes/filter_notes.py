"""What the author of a scenario with a Kalman filter should know."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.computer.estimation.filter import Filter
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.scenario.spec import Scenario

#: Turn between readings [deg] from which a quarter of random filters without a gyro were false:
#: design/0010.
_FAR_DEG = 6.0


def filter_notes(scenario: Scenario) -> list[str]:
    """Notes on filters, one line each."""
    return [*assess(_CHECKS, scenario)]


def _filters(scenario: Scenario) -> list[Filter]:
    control = scenario.control
    estimators = [control.estimator, *control.estimators.values()]
    return [spec for spec in estimators if isinstance(spec, Filter)]


def _step_notes(scenario: Scenario) -> Iterator[str]:
    """On steps of uneven length, for which the noise of a gyro is stated."""
    control = scenario.control
    uneven = control.measure_s > 0.0 and control.actuate_s != control.sample_s
    if uneven and any(isinstance(spec, KalmanGyro) for spec in _filters(scenario)):
        steps = f"{control.sample_s:g} and of {control.actuate_s:g} s"
        yield (
            f"a filter with a gyro takes steps of {steps} here: its angle random walk can be right "
            "for only one of these intervals; torquer filter-check shows the effect"
        )


def _turn_notes(scenario: Scenario) -> Iterator[str]:
    """On a body that turns far between readings, without a gyro that shows how."""
    sensors, control = scenario.spacecraft.sensors(), scenario.control
    used = {
        each.device for spec in _filters(scenario) if not spec.has_gyro for each in spec.assumes
    }
    found = [sensors[name] for name in used if name in sensors]
    interval_s = max((sensor.sample_s or control.cycle_s for sensor in found), default=0.0)
    turn_deg = float(np.linalg.norm(scenario.initial.rate_deg_s)) * interval_s
    if turn_deg > _FAR_DEG:
        yield (
            f"a filter without a gyro has readings {interval_s:g} s apart, between which the body "
            f"turns by {turn_deg:.3g} deg at the initial rate: from {_FAR_DEG:g} deg on it may be "
            "wrong and sure of itself; torquer filter-check shows it"
        )


def _model_notes(scenario: Scenario) -> Iterator[str]:
    """On a noise of the magnetometer that leaves no room for the errors of the field on board."""
    noises = [spec.magnetometer_noise_nt for spec in _filters(scenario)]
    given = [noise_nt for noise_nt in noises if noise_nt is not None]
    models = scenario.model_errors() if given else None
    if models is None:
        return
    off_nt = 1e9 * models.field_t / math.sqrt(3.0)
    whole_nt = math.hypot(off_nt, scenario.spacecraft.one_of("magnetometer").noise_nt)
    for noise_nt in dict.fromkeys(each for each in given if each < whole_nt):
        yield (
            f"magnetometer_noise_nt = {noise_nt:g} is below the {whole_nt:.3g} nT of each "
            f"component by which readings differ from the field on board ({off_nt:.3g} of it due "
            "to the models, which does not average out): torquer filter-check shows the effect"
        )


_CHECKS = {
    "the steps of the filter": _step_notes,
    "the turn between the filter's readings": _turn_notes,
    "the models on board": _model_notes,
}
