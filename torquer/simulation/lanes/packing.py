"""Members of a campaign in lanes: where their numbers stand, put in and taken out."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from torquer.base.columns import Column, Records
from torquer.compile.lanes import LEFT_OUT, SHARED, Fields, LaneLayout, Parts, Rows, lane_rows
from torquer.simulation.loop.state import Dynamics, Plant, State
from torquer.simulation.propagate.lane_stages import SPUN, STEP
from torquer.spacecraft.failures import COIL_FAILURE, COMPUTER_FAILURE, SENSOR_FAILURE

#: No parts that are packed already.
NONE: Mapping = MappingProxyType({})
#: What moves the body begins at a multiple of this many numbers: a few sun sensors change none of
#: its places, and so not the compiled `propagate`.
_BEGINS = 256
#: Records at which the loop looks once for all members.
_SHARED = (SENSOR_FAILURE, COIL_FAILURE, COMPUTER_FAILURE)


class Packed(NamedTuple):
    """A member as numbers: those of its lane, and what is not a number.

    `of_loop`, `of_dynamics`: where the numbers stand that the loop and `propagate` use;
    `parameters_at`: place of the parameters of laws and estimators, which their memory follows;
    `rods_at`: of what hysteresis rods remember; `rotors_at`: of the state of the wheels' rotors.
    `parts`: what has been packed, for members that have the very same.
    """

    numbers: np.ndarray
    shared: tuple
    of_loop: LaneLayout
    of_dynamics: LaneLayout
    parameters_at: int
    rods_at: int
    rotors_at: int
    parts: dict[tuple[int, int], "_Part"]


class _Part(NamedTuple):
    """A part of a tuple as it is packed: itself, its numbers, what is shared of it, its kind."""

    value: tuple | np.ndarray | Records
    numbers: list[float | Column]
    shared: list
    kind: Any


class _Packing:
    """Numbers one after another, with their places.

    `known`: parts that need not be packed again at the same place, by their identity and place.
    """

    def __init__(self, known: Mapping[tuple[int, int], _Part]):
        self.numbers: list[float | Column] = []
        self.shared: list = []
        self.known = known
        self.parts: dict[tuple[int, int], _Part] = {}

    def put(self, numbers) -> int:
        """Place of the first of these."""
        place = len(self.numbers)
        self.numbers.extend(np.ravel(numbers).tolist())
        return place

    def rows(self, array: np.ndarray | Records) -> tuple[int, Rows]:
        """An array, or one of records."""
        if isinstance(array, Records):
            place = len(self.numbers)
            self.numbers.extend(array.columns())
            return place, lane_rows(array.values[0])
        numbers = array.view(np.float64) if array.dtype.names else array
        return self.put(numbers), lane_rows(array)

    def part(self, value):
        """A part of a tuple, as `Parts` tell it."""
        if not isinstance(value, tuple | np.ndarray | Records):
            self.shared.append(value)
            return SHARED
        key = id(value), len(self.numbers)
        if (part := self.known.get(key)) is not None:
            self.numbers += part.numbers
            self.shared += part.shared
            return part.kind
        numbers, shared = len(self.numbers), len(self.shared)
        kind = self._pack(value)
        self.parts[key] = _Part(value, self.numbers[numbers:], self.shared[shared:], kind)
        return kind

    def _pack(self, value: tuple | np.ndarray | Records):
        if isinstance(value, tuple):
            if (
                value
                and all(isinstance(each, float | Column) for each in value)
                and not _is_named(value)
            ):
                place = len(self.numbers)
                self.numbers += value
                return Parts(tuple(range(place, place + len(value))))
            return Parts(tuple(map(self.part, value)))
        if isinstance(value, Records) or value.dtype not in _SHARED:
            return self.rows(value)
        self.shared.append(value.tobytes())
        return LEFT_OUT


def pack_member(
    plant: Plant, dynamics: Dynamics, state: State, known: Mapping[tuple[int, int], _Part] = NONE
) -> Packed:
    """Numbers and layouts of a member; `known`: parts of another one, packed.

    What the loop uses comes first, so that its code is the same whatever moves the body. Parameters
    and memory of laws come last and are found by their places: the code is the same for all laws.
    """
    packing, board = _Packing(known), state.board
    of_board = packing.rows(board.known)
    of_loop = {
        "cells": packing.rows(state.cells),
        "sensors": packing.rows(state.sensors),
        "coils": packing.rows(state.coils),
        "rotors": packing.rows(state.rotors),
        "board": (0, Fields(_fields({"known": of_board}))),
    }
    believed = {name: packing.rows(part) for name, part in state.allocation._asdict().items()}
    of_loop["allocation"] = (0, Fields(_fields(believed)))
    devices = packing.part(plant)
    packing.put(np.zeros(-len(packing.numbers) % _BEGINS))
    of_dynamics = {name: of_loop[name] for name in ("cells", "coils", "rotors")} | {
        "held": packing.rows(state.held),
        "coefficients": packing.rows(state.coefficients),
        "rods": packing.rows(state.rods),
        "steps": packing.rows(np.zeros(1, STEP)),
        "spun": packing.rows(np.zeros(1, SPUN)),
    }
    moving = packing.part(dynamics)
    parameters_at = packing.put(board.parameters)
    packing.put(board.memory)
    packing.shared += [len(board.parameters), len(board.memory)]
    return Packed(
        _as_rows(packing.numbers),
        tuple(packing.shared),
        LaneLayout(Fields(_fields(of_loop)), devices),
        LaneLayout(Fields(_fields(of_dynamics)), moving),
        parameters_at,
        of_dynamics["rods"][0],
        of_loop["rotors"][0],
        packing.parts,
    )


def shared_parts(plant: Plant, dynamics: Dynamics) -> tuple:
    """What is no number of a lane: members flown together have it alike."""
    packing = _Packing(NONE)
    packing.part(plant)
    packing.part(dynamics)
    return tuple(packing.shared)


def _as_rows(numbers: list) -> np.ndarray:
    """Numbers (size,) of a member; (n, size) of as many as there are in the columns among them."""
    columns = {k: each.values for k, each in enumerate(numbers) if isinstance(each, Column)}
    if not columns:
        return np.array(numbers)
    base = [0.0 if k in columns else each for k, each in enumerate(numbers)]
    rows = np.tile(np.array(base), (len(next(iter(columns.values()))), 1))
    for k, values in columns.items():
        rows[:, k] = values
    return rows


def _is_named(value: tuple) -> bool:
    return hasattr(value, "_fields")


def _fields(places: dict) -> tuple:
    return tuple((name, place, kind) for name, (place, kind) in places.items())
