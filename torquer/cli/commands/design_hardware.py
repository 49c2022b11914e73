"""`torquer design coil` and `torquer design bench`."""

from typing import Annotated

from torquer.cli.options import FLAT, Json
from torquer.cli.output import print_answer
from torquer.design.requests import BenchRequest, CoilRequest


def coil(*, how: Annotated[CoilRequest, FLAT], json: Json = False) -> int:
    """A magnetorquer without a core: power of copper and aluminium, and its wire by gauge.

    The power follows from dipole, diameter and mass alone; the gauge divides it between voltage and
    current. Round turns of bare wire are assumed; the wound section is 60 % metal.
    """
    from torquer.design.coil_design import coil as answer

    return print_answer(answer(how), json)


def bench(*, how: Annotated[BenchRequest, FLAT], json: Json = False) -> int:
    """From a B-dot test on a bench to the time in orbit, for the same initial rate.

    Coils at their limits: the time goes with inertia over field. Below the limits: with inertia
    over the square of the field. A test usually begins with the first and ends with the second.
    """
    from torquer.design.bench_scaling import bench as answer

    return print_answer(answer(how), json)
