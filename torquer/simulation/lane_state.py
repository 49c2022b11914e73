"""Members of a campaign in lanes: where their numbers stand, put in and taken out."""

from typing import NamedTuple

import numpy as np

from torquer.lanes import LEFT_OUT, SHARED, ZERO, Fields, Layout, Parts, Rows, rows_of
from torquer.simulation.state import Plant, State
from torquer.spacecraft.failures import FAILURE


class Packed(NamedTuple):
    """A member as numbers: those of its lane, what is not a number, and the layout of both."""

    numbers: np.ndarray
    shared: tuple
    layout: Layout


class _Packing:
    """Numbers one after another, with their places."""

    def __init__(self):
        self.numbers, self.shared = [], []

    def put(self, numbers) -> int:
        """Place of the first of these."""
        place = len(self.numbers)
        self.numbers.extend(np.ravel(numbers).tolist())
        return place

    def rows(self, array: np.ndarray) -> tuple[int, Rows]:
        """An array, or one of records."""
        numbers = array.view(np.float64) if array.dtype.names else array
        return self.put(numbers), rows_of(array)

    def part(self, value):
        """A part of a tuple, as `Parts` tell it."""
        if isinstance(value, tuple):
            if value and all(isinstance(each, float) for each in value) and not _is_named(value):
                return Parts(tuple(map(self.put, value)))
            return Parts(tuple(map(self.part, value)))
        if isinstance(value, np.ndarray) and value.dtype != FAILURE:
            return self.rows(value)
        if isinstance(value, np.ndarray):
            self.shared.append(value.tolist())
            return LEFT_OUT
        self.shared.append(value)
        return ZERO if isinstance(value, float) and value == 0.0 else SHARED


def packed(plant: Plant, state: State) -> Packed:
    """Numbers and layout of a member.

    What is known, the cells, and parameters and memory of the laws come first. The layout does not
    tell of these two: laws find them by their places, and the loop is the same code for all laws.
    """
    packing, board = _Packing(), state.board
    known = packing.rows(board.known)
    cells = packing.rows(state.cells)
    packing.shared += [len(board.parameters), len(board.memory)]
    packing.put(board.parameters)
    packing.put(board.memory)
    of_state = {
        "cells": cells,
        "sensors": packing.rows(state.sensors),
        "coils": packing.rows(state.coils),
        "rotors": packing.rows(state.rotors),
        "held": packing.rows(state.held),
        "coefficients": packing.rows(state.coefficients),
        "board": (0, Fields(_fields({"known": known}))),
    }
    parts = packing.part(plant)
    layout = Layout(Fields(_fields(of_state)), parts, len(packing.numbers))
    return Packed(np.array(packing.numbers), tuple(packing.shared), layout)


def _is_named(value: tuple) -> bool:
    return hasattr(value, "_fields")


def _fields(places: dict) -> tuple:
    return tuple((name, place, kind) for name, (place, kind) in places.items())
