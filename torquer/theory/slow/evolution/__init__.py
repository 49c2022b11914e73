"""Closed averaged equations, one file per law; adding one is one file and one line here."""

from torquer.theory.slow.evolution.bdot import BDOT, BDOT_ANY_FIELD
from torquer.theory.slow.evolution.nutation_damping import NUTATION_DAMPING
from torquer.theory.slow.evolution.preliminary_1 import PRELIMINARY_1
from torquer.theory.slow.evolution.preliminary_2 import PRELIMINARY_2
from torquer.theory.slow.evolution.reorientation import REORIENTATION, REORIENTATION_AS_PRINTED
from torquer.theory.slow.evolution.sdot import SDOT
from torquer.theory.slow.evolution.spin_up import SPIN_UP

#: Closed averaged equations of every law that has them, by the law's name.
EVOLUTIONS = {
    evolution.name: evolution
    for evolution in (
        BDOT,
        BDOT_ANY_FIELD,
        NUTATION_DAMPING,
        SPIN_UP,
        REORIENTATION,
        REORIENTATION_AS_PRINTED,
        PRELIMINARY_1,
        PRELIMINARY_2,
        SDOT,
    )
}
