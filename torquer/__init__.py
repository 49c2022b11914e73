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

__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str):
    if name not in _HOMES:
        raise AttributeError(f"module 'torquer' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted(__all__)
