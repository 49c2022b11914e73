"""Laws that come with the package: each has its line in the table, in the list and in `ask`.

A scheme may be made of any of them; its kernel asks a law by its place in the list.
"""

from torquer.control.bdot import (
    Bdot,
    BdotDerivative,
    BdotModel,
    BdotRate,
    bdot_derivative,
    bdot_difference,
    bdot_model,
    bdot_rate,
)
from torquer.control.nutation_damping import (
    NutationDamping,
    NutationDampingDerivative,
    NutationDampingRate,
    nutation_damping_derivative,
    nutation_damping_difference,
    nutation_damping_rate,
)
from torquer.control.off import Off, no_answer
from torquer.control.preliminary_1 import Preliminary1, preliminary_1
from torquer.control.preliminary_2 import Preliminary2, preliminary_2
from torquer.control.reorientation import Reorientation, reorientation
from torquer.control.spin_up import SpinUp, spin_up
from torquer.control.three_axis import ThreeAxis, three_axis
from torquer.control.unloading import Unloading, unloading
from torquer.engine import inlined

BUILT_IN = {
    "off": Off,
    "bdot": Bdot,
    "bdot_rate": BdotRate,
    "bdot_derivative": BdotDerivative,
    "bdot_model": BdotModel,
    "nutation_damping": NutationDamping,
    "nutation_damping_rate": NutationDampingRate,
    "nutation_damping_derivative": NutationDampingDerivative,
    "spin_up": SpinUp,
    "reorientation": Reorientation,
    "preliminary_1": Preliminary1,
    "preliminary_2": Preliminary2,
    "three_axis": ThreeAxis,
    "unloading": Unloading,
}

#: The laws' kernels; places as in `ask`.
KERNELS = (
    no_answer,
    bdot_difference,
    bdot_rate,
    bdot_derivative,
    bdot_model,
    nutation_damping_difference,
    nutation_damping_rate,
    nutation_damping_derivative,
    spin_up,
    reorientation,
    preliminary_1,
    preliminary_2,
    three_axis,
    unloading,
)


@inlined
def ask(place, measured, parameters, memory):
    """The answer of the law at a place in the list.

    (Numba takes no list of kernels: it would make addresses of them, which no cache can keep.)
    """
    if place == 0:
        return no_answer(measured, parameters, memory)
    if place == 1:
        return bdot_difference(measured, parameters, memory)
    if place == 2:
        return bdot_rate(measured, parameters, memory)
    if place == 3:
        return bdot_derivative(measured, parameters, memory)
    if place == 4:
        return bdot_model(measured, parameters, memory)
    if place == 5:
        return nutation_damping_difference(measured, parameters, memory)
    if place == 6:
        return nutation_damping_rate(measured, parameters, memory)
    if place == 7:
        return nutation_damping_derivative(measured, parameters, memory)
    if place == 8:
        return spin_up(measured, parameters, memory)
    if place == 9:
        return reorientation(measured, parameters, memory)
    if place == 10:
        return preliminary_1(measured, parameters, memory)
    if place == 11:
        return preliminary_2(measured, parameters, memory)
    if place == 12:
        return three_axis(measured, parameters, memory)
    if place == 13:
        return unloading(measured, parameters, memory)
    return (0.0, 0.0, 0.0)
