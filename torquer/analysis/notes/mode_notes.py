"""What the author of a mode table should know before the run."""

from torquer.computer.estimation.filter import Filter
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
    craft, control = scenario.spacecraft, scenario.control
    flown, units = craft.flown().values(), craft.units()
    has = {name for each in flown for name in (each.device.name, each.device.kind)}
    named = control.named()
    laws = named.known_laws()
    needs = frozenset().union(*(law.needs for law in laws.values()))
    for spec in (control.estimator, *control.estimators.values()):
        needs |= spec.needs if isinstance(spec, Filter) else frozenset()
    for device in DEVICES:
        # signals read the Sun sensors; what laws need that are not known cannot be told
        may = device.need in {*needs, "sun"} or len(laws) < len(named.laws)
        if device.stands_in and may:
            has.add(device.name)
    if craft.wheels is not None:
        has.add("tachometers")
    return frozenset(has | {each.name for each in units})


def _driven_by(law) -> frozenset[str]:
    driven = {"coils": law.drives_coils, "wheels": law.drives_wheels}
    return frozenset(key for key, does in driven.items() if does)


def _given_by(spec) -> frozenset[str]:
    """What an estimator gives, `sigma` included."""
    return spec.gives if spec.kind in _WITHOUT_SIGMA else spec.gives | {"sigma"}
