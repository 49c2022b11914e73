"""torquer: design, analyse, simulate and fly attitude control with magnetorquers and wheels.

    >>> import torquer
    >>> scenario = torquer.scenario_from_text('''
    ... start = 2025-07-01T00:00:00Z
    ... orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6 }
    ... spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
    ... spacecraft.coils.limit_a_m2 = 0.2
    ... initial.rate_deg_s = [8, -5, 3]
    ... control = { law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }, sample_s = 1.0 }
    ... simulation = { duration_s = 600, record_s = 10.0 }
    ... ''')
    >>> result = torquer.simulate(scenario)  # an xarray.Dataset with units, frames, scenario
    >>> print(f"{float(result.torquer.rate()[-1]):.1f} deg/s after ten minutes")
    7.4 deg/s after ten minutes
    >>> figure = result.torquer.plot.rate()  # derived quantities and pictures: `result.torquer`

Examples of the names below go on from here. `satellite.toml` is a file with the text above;
`releases.toml` has a table [campaign] besides.

Names are imported when first used, so that `import torquer` costs nothing.
"""

from torquer.base.lazy import lazily
from torquer.base.version import VERSION

#: True to type checkers and editors; `typing` itself would cost a hundredth of a second.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from torquer.analysis.citations import citations as citations
    from torquer.analysis.derived import derive as derive
    from torquer.analysis.filters.smoothing import smooth_run as smooth_run
    from torquer.analysis.summary import summarise as summarise, summary_rows as summary_rows
    from torquer.analysis.table import to_dataframe as to_dataframe, write_table as write_table
    from torquer.base.explain import ScenarioError as ScenarioError
    from torquer.campaign.fly import fly_campaign as fly_campaign
    from torquer.campaign.load import load_campaign as load_campaign
    from torquer.campaign.parts import join_parts as join_parts
    from torquer.computer.blocks.law import Law as Law, law as law
    from torquer.computer.estimation import ESTIMATORS as ESTIMATORS
    from torquer.computer.estimation.estimator import estimator as estimator
    from torquer.computer.inputs import Inputs as Inputs
    from torquer.computer.interface import Command as Command, Estimate as Estimate
    from torquer.computer.laws import LAWS as LAWS
    from torquer.computer.laws.recommended import (
        recommended_scheme as recommended_scheme,
        standard_scheme as standard_scheme,
    )
    from torquer.computer.scheme import stage_at as stage_at, stage_starts_s as stage_starts_s
    from torquer.environment.field import FIELDS as FIELDS
    from torquer.environment.orbit import ORBITS as ORBITS
    from torquer.flight.c99.export import export_c as export_c
    from torquer.report import write_report as write_report
    from torquer.report.flight.compared import Comparison as Comparison, compare as compare
    from torquer.report.one_page import page as page
    from torquer.report.paper import (
        paper_figures as paper_figures,
        write_paper_figures as write_paper_figures,
    )
    from torquer.report.plot import plot as plot
    from torquer.report.results import (
        concat as concat,
        load as load,
        pick_run as pick_run,
        resume as resume,
        simulate as simulate,
    )
    from torquer.scenario.load import (
        load_scenario as load_scenario,
        scenario_from_text as scenario_from_text,
        scenario_schema as scenario_schema,
    )
    from torquer.scenario.spec import Scenario as Scenario
    from torquer.simulation.outside.flight import Flight as Flight
    from torquer.simulation.results.dataset import flown_laws as flown_laws
    from torquer.simulation.results.file import save as save
    from torquer.simulation.setup.simulate import RunStopped as RunStopped
    from torquer.simulation.setup.step_error import integration_error as integration_error
    from torquer.spacecraft.disturbance.user import TorqueInputs as TorqueInputs
    from torquer.spacecraft.sensors.own_sensor import SensorInputs as SensorInputs
    from torquer.theory.slow.gains import (
        bdot_gain as bdot_gain,
        bdot_greatest_gain as bdot_greatest_gain,
        sampling_limit_rad_s as sampling_limit_rad_s,
    )

__version__ = VERSION

_imported, __dir__, __all__ = lazily(__name__, __file__)
__all__ += ["__version__"]
#: Names after whose use a result may be at hand: xarray then knows `result.torquer`.
_GIVE_RESULTS = ("Flight", "compare")


def __getattr__(name: str):
    value = _imported(name)
    if name in _GIVE_RESULTS:
        import torquer.report.accessor  # noqa: F401  registers itself
    return value
