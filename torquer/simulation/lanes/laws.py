"""A law for all members in lanes: the law's own function in a loop that becomes vectors."""

# mypy: disable-error-code="name-defined"

import functools
import math
from collections.abc import Callable
from types import FunctionType
from typing import cast

from torquer.base.user_source import cache_beside, plain_function, source_file
from torquer.compile import engine
from torquer.compile.lanes import LANES, Fields, Rows, lane_maker, record_fields
from torquer.compile.overloads import FirstClass
from torquer.computer.blocks import plugin
from torquer.computer.blocks.adapter import (
    Kind,
    Shape,
    make_inner,
    memory_names,
    place_adapter,
    record_maker,
)
from torquer.computer.blocks.law import Law
from torquer.computer.informed import doubt_of_law, is_informed
from torquer.computer.inputs import read_inputs
from torquer.computer.interface import KNOWN
from torquer.simulation.loop.computers import LANES_LAW
from torquer.simulation.loop.state import CELLS

#: Where the cells begin in a lane: what is known comes first.
CELLS_AT = KNOWN.itemsize // 8


def _plain_law(cells, count, first_parameter, first_memory):
    informed = 0
    for lane in range(count):
        informed += doubt_of_law(_waits, _known(cells, 0, lane)) == 0.0  # noqa: F821
    for lane in range(count):
        # all at once where all are informed: a condition of each keeps a loop from taking vectors
        if informed == count or is_informed(_waits, _known(cells, 0, lane)):  # noqa: F821
            parameters = _named(_parameters(cells, first_parameter, lane))  # noqa: F821
            known, memory = _known(cells, 0, lane), _memory(cells, first_memory, lane)  # noqa: F821
            command = _unify(_function(read_inputs(known), parameters, memory))  # noqa: F821
            (x, y, z), (u, v, w) = command.dipole_a_m2, command.torque_n_m
            c = _cells(cells, CELLS_AT, lane)  # noqa: F821
            c.dipole_x += x
            c.dipole_y += y
            c.dipole_z += z
            c.torque_x += u
            c.torque_y += v
            c.torque_z += w


def law_in_lanes(law: Law):
    """A compiled law as the loop over lanes calls it; ValueError if it does not compile so."""
    names, cells = memory_names(law.memory), len(law.first_memory())
    return _compile_lanes(law.kind, law.function, Shape(law.parameters), names, cells, law.waits)


@functools.cache
def _compile_lanes(
    kind: Kind, function: Callable, shape: Shape, names: tuple | None, cells: int, waits: int
):
    plain = plain_function(function)
    own = engine.is_own(plain)
    parts = {
        "_function": make_inner(function, own, shape),
        "_unify": kind.unify,
        "_named": record_maker(shape),
        "_known": lane_maker(record_fields(KNOWN)),
        "_cells": lane_maker(record_fields(CELLS)),
        "_parameters": lane_maker(Rows((0,), 1)),
        "_memory": lane_maker(Rows((cells,), 1) if names is None else _named_memory(names)),
        "LANES": LANES,
        "CELLS_AT": CELLS_AT,
        "_waits": waits,
        "doubt_of_law": doubt_of_law,
        "is_informed": is_informed,
        "read_inputs": read_inputs,
    }
    file = source_file(plain)
    known = file is not None and plain.__closure__ is None
    must = f"{kind.name} {plain.__name__}: must compile for members in lanes"
    form, loop = f"lanes {LANES} {cells} {waits}", cast(FunctionType, _plain_law)
    with cache_beside(file if known and not own else None):
        law = place_adapter(loop, plain, shape, names, parts, form)
        made = plugin.compile_plugin(law, LANES_LAW, must, keep=known, error_model="numpy")
    return FirstClass(made, LANES_LAW)


def _named_memory(names: tuple) -> Fields:
    """A memory with names, as `adapter.names_of` tells them."""
    fields, place = [], 0
    for name, shape in names:
        fields.append((name, place, Rows(shape, 1) if shape else None))
        place += math.prod(shape)
    return Fields(tuple(fields))
