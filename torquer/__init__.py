"""torquer: design, analyse, simulate and fly attitude control with magnetorquers and wheels.

    import torquer
    scenario = torquer.load_scenario("chibis_m_detumble.toml")
    result = torquer.simulate(scenario)      # an xarray.Dataset with units, frames, scenario
    torquer.summary_of(result)

Names are imported when first used, so that `import torquer` costs nothing.
"""

__version__ = "0.1.0"

#: Public names and the modules that define them.
_HOMES = {
    "Inputs": "torquer.interface",
    "Command": "torquer.interface",
    "Estimate": "torquer.interface",
    "Scenario": "torquer.scenario.spec",
    "ScenarioError": "torquer.scenario.load",
    "load_scenario": "torquer.scenario.load",
    "scenario_from_text": "torquer.scenario.load",
    "scenario_schema": "torquer.scenario.load",
    "simulate": "torquer.simulation.simulate",
    "RunStopped": "torquer.simulation.simulate",
    "resume": "torquer.simulation.simulate",
    "save": "torquer.simulation.result",
    "load": "torquer.simulation.result",
    "law": "torquer.control.law",
    "Law": "torquer.control.law",
    "LAWS": "torquer.control",
    "recommended_scheme": "torquer.control.recommended",
    "standard_scheme": "torquer.control.recommended",
    "stage_at": "torquer.control.scheme",
    "stage_starts_s": "torquer.control.scheme",
    "FIELDS": "torquer.environment.field",
    "ORBITS": "torquer.orbit",
    "summary_of": "torquer.analysis.summary",
    "rows_of": "torquer.report.flight.summary_rows",
    "write_report": "torquer.report",
    "bdot_gain": "torquer.theory.gains",
    "bdot_greatest_gain": "torquer.theory.gains",
    "sampling_limit_rad_s": "torquer.theory.gains",
}

#: True to type checkers and editors, which learn the same names below.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from torquer.analysis.summary import summary_of as summary_of
    from torquer.control import LAWS as LAWS
    from torquer.control.law import Law as Law
    from torquer.control.law import law as law
    from torquer.control.recommended import recommended_scheme as recommended_scheme
    from torquer.control.recommended import standard_scheme as standard_scheme
    from torquer.control.scheme import stage_at as stage_at
    from torquer.control.scheme import stage_starts_s as stage_starts_s
    from torquer.conventions import Measured as Measured
    from torquer.environment.field import FIELDS as FIELDS
    from torquer.orbit import ORBITS as ORBITS
    from torquer.report import write_report as write_report
    from torquer.report.flight.summary_rows import rows_of as rows_of
    from torquer.scenario.load import ScenarioError as ScenarioError
    from torquer.scenario.load import load_scenario as load_scenario
    from torquer.scenario.load import scenario_from_text as scenario_from_text
    from torquer.scenario.load import scenario_schema as scenario_schema
    from torquer.scenario.spec import Scenario as Scenario
    from torquer.simulation.result import load as load
    from torquer.simulation.result import save as save
    from torquer.simulation.simulate import RunStopped as RunStopped
    from torquer.simulation.simulate import resume as resume
    from torquer.simulation.simulate import simulate as simulate
    from torquer.theory.gains import bdot_gain as bdot_gain
    from torquer.theory.gains import bdot_greatest_gain as bdot_greatest_gain
    from torquer.theory.gains import sampling_limit_rad_s as sampling_limit_rad_s

__all__ = [*_HOMES, "__version__"]


if not TYPE_CHECKING:

    def __getattr__(name: str):
        if name not in _HOMES:
            raise AttributeError(f"module 'torquer' has no attribute {name!r}")
        import importlib

        value = getattr(importlib.import_module(_HOMES[name]), name)
        globals()[name] = value
        return value


def __dir__():
    return sorted(__all__)
