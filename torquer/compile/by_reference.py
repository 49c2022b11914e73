"""Long records by reference, for a large kernel that is called many times in a row.

Numba hands every number of a record over as an argument of its own. A kernel that stands in the
code once, and not wherever it is used, would take some hundred of them with every call; this way
it takes the place where they stand, on the stack of the kernel that stored them.
"""

from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import ArgPacker, default_manager
from numba.extending import intrinsic, models, overload, register_model

from torquer.compile.engine import COMPILED, INLINED_OPTIONS, without_owner

#: Records of up to so many numbers are used as they are. The constants of a step have 41, with
#: wheels 78 and with disturbance torques 132: called, a control step with wheels took 17 % longer
#: than inlined, and one with disturbance torques as long.
_MOST = 100


class _Place(types.Type):
    """Where a record stands."""

    def __init__(self, record):
        self.record = record
        super().__init__(name=f"Place({record})")


def _numbers_of(record) -> ArgPacker:
    return ArgPacker(default_manager, [record])


@register_model(_Place)
class _PlaceModel(models.PrimitiveModel):
    def __init__(self, manager, of_type):
        numbers = _numbers_of(of_type.record).argument_types
        super().__init__(manager, of_type, ir.LiteralStructType(numbers).as_pointer())


@intrinsic
def _stored(typing_context, record):
    def leave(context, builder, signature, arguments):
        return without_owner(context, builder, record, arguments[0])

    def build(context, builder, signature, arguments):
        place = cgutils.alloca_once(builder, context.get_value_type(signature.return_type).pointee)
        given = leave(context, builder, signature, arguments)
        for k, number in enumerate(_numbers_of(record).as_arguments(builder, [given])):
            builder.store(number, cgutils.gep_inbounds(builder, place, 0, k))
        return place

    if len(_numbers_of(record).argument_types) <= _MOST:
        return record(record), leave
    return _Place(record)(record), build


@intrinsic
def _loaded(typing_context, place):
    def build(context, builder, signature, arguments):
        packer = _numbers_of(place.record)
        places = (
            cgutils.gep_inbounds(builder, arguments[0], 0, k)
            for k in range(len(packer.argument_types))
        )
        return packer.from_arguments(builder, tuple(map(builder.load, places)))[0]

    return place.record(place), build


def _unchanged(record):
    return record


#: For kernels: the place of a long record, which is valid in the kernel that stores it; a short
#: record itself. The arrays in it are not counted as used: others must keep them alive.
stored: Callable = _stored if COMPILED else _unchanged
#: For kernels: the record at a place.
loaded: Callable = _loaded if COMPILED else _unchanged


def by_record(kernel: Callable, of_place: Callable) -> Callable:
    """The function `(record or place, *arguments)` that chooses between two kernels."""

    def chosen(record, *arguments):
        return kernel(record, *arguments)

    @overload(chosen, jit_options=INLINED_OPTIONS)
    def _choose(record, *arguments):
        used = of_place if isinstance(record, _Place) else kernel
        return lambda record, *arguments: used(record, *arguments)

    return chosen
