"""The picture of an answer of `torquer.design` or `torquer.theory`, for notebooks and scripts.

    sweep = torquer.design.detumble(scenario)
    torquer.plot(sweep).savefig("gains.png")

The functions that answer stand below those that draw, so an answer has no method of its own that
draws it: this function knows all kinds.
"""

from functools import singledispatch
from typing import Any

from matplotlib.figure import Figure

from torquer.design.coil_design import CoilSizes
from torquer.design.gain_sweep import GainSweep
from torquer.design.gyro.answer import GyroDesign
from torquer.design.pointing_answer import PointingBudget
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.report.theory.designs import draw_coils, draw_design, draw_gains
from torquer.report.theory.law_motion import draw_law_motion
from torquer.report.theory.magneto_gyro import draw_gyro_design
from torquer.report.theory.magneto_gyro_models import draw_gyro_models
from torquer.report.theory.pointing import draw_pointing
from torquer.theory.averaged.answer import LawMotion
from torquer.theory.magneto_gyro.models import GyroModels


@singledispatch
def plot(answer: Any) -> Figure | dict[str, Figure]:
    """A matplotlib figure of an answer of `torquer.design` or `torquer.theory`, or several by name.

    TypeError for an answer without a picture.

        >>> from torquer.design import CoilRequest, coil
        >>> figure = torquer.plot(coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.2)))
    """
    kinds = sorted(kind.__name__ for kind in plot.registry if kind is not object)
    raise TypeError(
        f"plot: must be given one of {', '.join(kinds)}; received {type(answer).__name__}"
    )


plot.register(CoilSizes, draw_coils)
plot.register(GainSweep, draw_gains)
plot.register(GyroDesign, draw_gyro_design)
plot.register(GyroModels, draw_gyro_models)
plot.register(LawMotion, draw_law_motion)
plot.register(PointingBudget, draw_pointing)
plot.register(ThreeAxisAnswer, draw_design)
