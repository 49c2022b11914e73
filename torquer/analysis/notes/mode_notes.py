"""What the author of a mode table should know before the run."""

from torquer.base.user_code import OwnFile
from torquer.computer.modes.check import faults, findings
from torquer.computer.modes.finding import Facts, Finding
from torquer.scenario.spec import Scenario
from torquer.spacecraft.sensors.devices import DEVICES

#: Kinds of estimators that do not state how good they are.
_WITHOUT_SIGMA = ("attitude_sensor", "rate_from_field", "law", "none")


def mode_notes(scenario: Scenario) -> list[str]:
    """Faults that the checker finds in the modes, one line each."""
    modes = scenario.control.named().modes
    found = faults(modes, mode_facts(scenario)) if modes else []
    return [f"modes: {finding.message}" for finding in found]


def mode_findings(scenario: Scenario) -> list[Finding]:
    """All findings of the checker on the modes; none for laws that always work."""
    modes = scenario.control.named().modes
    return findings(modes, mode_facts(scenario)) if modes else []


def mode_facts(scenario: Scenario) -> Facts:
    """What the checker of mode tables is to know of a scenario."""
    control = scenario.control
    specs, laws = control.named().laws, control.named().known_laws()
    estimators = {"estimator": control.estimator, **control.estimators}
    gives = {name: _given_by(spec) for name, spec in estimators.items()}
    return Facts(
        step_s=control.sample_s,
        kinds={name: spec.kind for name, spec in specs.items()},
        drives={name: _driven_by(law) for name, law in laws.items() if specs[name].kind != "off"},
        gives={"attitude_sensor": frozenset({"attitude", "rate"}), "none": frozenset(), **gives},
        sensors=_sensors_read(scenario),
    )


def _sensors_read(scenario: Scenario) -> frozenset[str]:
    """Names of the sensors, and of the kinds, of which there are readings."""
    craft, flown = scenario.spacecraft, scenario.spacecraft.flown().values()
    of_flown = {name for each in flown for name in (each.name, each.device.name, each.device.kind)}
    ideal = {device.name for device in craft.standing_in(_needed(scenario))}
    return frozenset(of_flown | ideal | ({"tachometers"} if craft.wheels else set()))


def _needed(scenario: Scenario) -> frozenset[str]:
    """What laws, estimators and signals read; anything where a law is not known."""
    control, units = scenario.control, scenario.spacecraft.units()
    named = control.named()
    laws = named.known_laws()
    if len(laws) < len(named.laws):
        return frozenset(device.need for device in DEVICES)
    specs = (control.estimator, *control.estimators.values())
    estimators = [
        spec.estimator(units)
        for spec in specs
        if hasattr(spec, "estimator") and not isinstance(spec, OwnFile)
    ]
    own = named.modes.needs if named.modes is not None else frozenset()
    return own.union(*(block.needs for block in (*laws.values(), *estimators)))


def _driven_by(law) -> frozenset[str]:
    driven = {"coils": law.drives_coils, "wheels": law.drives_wheels}
    return frozenset(key for key, does in driven.items() if does)


def _given_by(spec) -> frozenset[str]:
    """What an estimator gives, `sigma` included."""
    return spec.gives if spec.kind in _WITHOUT_SIGMA else spec.gives | {"sigma"}
