"""Gains of control laws, coils, wheels and benches: a request, and an answer with its validity.

    import torquer
    from torquer.design import DetumbleRequest, detumble

    scenario = torquer.load_scenario("my_satellite.toml")
    sweep = detumble(scenario, DetumbleRequest(tip_off_deg_s=10.0))
    sweep.chosen.gain                    # A m^2 s/T
    sweep.data()                         # what `torquer design detumble --json` prints
    torquer.plot(sweep)                  # a matplotlib figure

- *Detumbling*: which gain of B-dot, by theory and in flights (`detumble`).
- *Three axes by coils alone*: gains by formula and by search, a periodic regulator (`three_axis`).
- *Magnetometer, coils and a pitch wheel*: gains of both stages (`magneto_gyro`).
- *Pointing budget*: errors of a held attitude by cause, predicted and flown (`pointing_budget`).
- *From a data sheet*: a scenario from a size class, with a campaign of what a data sheet leaves
  open (`from_sheet`); inertia, surfaces and residual dipole by themselves (`masses_of_box`,
  `equal_box_m`, `exposed_parts`, `residual_dipole_a_m2`).
- *A whole mission*: all of these that a satellite has, with verdicts and open points (`mission`).
- *Hardware*: a magnetorquer without a core (`coil`), a test on a bench (`bench`), wheel arrays
  (`wheels` of what `load_wheels` gives).

A request is a frozen dataclass, the very one that the command of the same name takes its options
from: `help(DetumbleRequest)` lists keys, units and ranges. A mistake in one is a `RequestError`
that names the key. An answer has `lines()`, `data()`, and shows itself as a table in notebooks.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.base.limits import RequestError as RequestError
    from torquer.design.bench_scaling import TimeInOrbit as TimeInOrbit, bench as bench
    from torquer.design.coil_design import CoilSizes as CoilSizes, coil as coil
    from torquer.design.detumbling import detumble as detumble
    from torquer.design.gain_sweep import GainSweep as GainSweep
    from torquer.design.gyro.answer import GyroDesign as GyroDesign
    from torquer.design.gyro.gains import magneto_gyro as magneto_gyro
    from torquer.design.left_out import (
        equal_box_m as equal_box_m,
        exposed_parts as exposed_parts,
        masses_of_box as masses_of_box,
        residual_dipole_a_m2 as residual_dipole_a_m2,
        size_classes as size_classes,
    )
    from torquer.design.mission_design import MissionDesign as MissionDesign, mission as mission
    from torquer.design.pointing_answer import (
        PointingBudget as PointingBudget,
        pointing_budget as pointing_budget,
    )
    from torquer.design.requests import (
        BenchRequest as BenchRequest,
        CoilRequest as CoilRequest,
        DetumbleRequest as DetumbleRequest,
        MagnetoGyroRequest as MagnetoGyroRequest,
        MissionRequest as MissionRequest,
        PointingRequest as PointingRequest,
        SheetRequest as SheetRequest,
        ThreeAxisRequest as ThreeAxisRequest,
        WheelsRequest as WheelsRequest,
    )
    from torquer.design.sheet import Sheet as Sheet, from_sheet as from_sheet
    from torquer.design.three_axis_answer import ThreeAxisAnswer as ThreeAxisAnswer
    from torquer.design.three_axis_gains import three_axis as three_axis
    from torquer.design.wheel_design import analyse as analyse
    from torquer.design.wheel_file import WheelDesign as WheelDesign, load_wheels as load_wheels
    from torquer.design.wheel_report import WheelReport as WheelReport, wheels as wheels
    from torquer.design.wheel_sweep import sweep_angle as sweep_angle

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
