"""The on-board computer of a scenario as a program: its control step, its tables, its state."""

import inspect
import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from torquer.base.user_source import plain_function
from torquer.computer import computer as on_board, gate as gates, reports
from torquer.computer.blocks import adapter
from torquer.computer.blocks.adapter import floats, memory_names
from torquer.computer.blocks.block import Block
from torquer.computer.computer import Blocks, first_board
from torquer.computer.interface import ESTIMATED, KNOWN, NO_COMMAND, PLACES, SENSED
from torquer.computer.laws.pointing import to_orbital_frame
from torquer.computer.modes import signals
from torquer.flight.c99.arithmetic import call_function
from torquer.flight.c99.calls import Cast, Failed, call_switch
from torquer.flight.c99.evaluate import at_hand
from torquer.flight.c99.gate import make_gate
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.print_c import kept_fields, reached_names
from torquer.flight.c99.program import Program, translate_repeatedly
from torquer.flight.c99.reads import Reads
from torquer.flight.c99.records import board_type, constants_type, make_record
from torquer.flight.c99.refusal import Refused
from torquer.flight.c99.texts import words_around
from torquer.flight.c99.translation import FAILURES, Function
from torquer.flight.c99.types import (
    BOOL,
    INT,
    NOTHING,
    REAL,
    TIME,
    Array,
    Record,
    Rows,
    Tuple,
    Type,
    find_type,
)
from torquer.flight.c99.values import Value, as_real, constant, select_part
from torquer.maths.geometry import vec3
from torquer.scenario.spec import Scenario
from torquer.simulation.outside.library import make_fingerprint
from torquer.simulation.setup.prepare import (
    collect_needs,
    estimator_numbers,
    make_blocks,
    modes_for,
    oldest_readings_s,
    signals_need,
    timetable_for,
)
from torquer.simulation.setup.several import make_selection

#: What the interface calls: their arguments are known by their names.
_ENTRIES = (
    *(gates.gated_step, gates.restart_estimators, gates.rebase),
    *(gates.command_mode, gates.hold, gates.set_flag, gates.set_parameter),
    *(reports.is_active, reports.active_estimator, reports.is_tripped),
)
#: Inputs that are times; from them follows what else is one.
_TIMES = frozenset({"Given.t_s", "Given.read_s", "Known.t_s", "Known.read_s", "GateNow.offset_s"})
#: What of the computer's record an estimator writes.
_ESTIMATE = [name for name in KNOWN.names or () if SENSED <= PLACES[name].start < ESTIMATED]
#: Arrays whose first index is the number of a sensor, with how many dimensions they have; by what
#: name the numbers are noted that the control step uses.
_ROWS, _USED = (("Known.readings", 2), ("Known.read_s", 1)), ("used", 1)
#: What is handed in at a step: a record of its own, for what is read there to be told apart.
_GIVEN = Rows(make_record("Given", KNOWN), 1)


class OnBoard(NamedTuple):
    """What is exported. `computer`: of constants, by field: arrays, records and numbers; `board`:
    what changes, at the start; `gate`: what its boundary checks by; `fingerprint`: by which a
    library is known as its export; `made`: the computer as the loop has it.
    """

    scenario: Scenario
    blocks: Blocks
    computer: dict[str, Any]
    board: on_board.Board
    gate: gates.Gate
    needs: frozenset[str]
    fingerprint: str
    made: on_board.Computer


class Export(NamedTuple):
    """The translated program with the types of its constants and of its state; `checks`: what its
    boundary checks by, of those readings alone that are used.
    """

    program: Program
    entries: dict[str, Function]
    computer: Record
    gate: Record
    state: Record
    checks: gates.Gate

    @property
    def board(self) -> Record:
        """The type of what changes on board."""
        return dict(self.state.fields)["board"]

    @property
    def known(self) -> dict[str, Type]:
        """What the state has in C of what is known on board."""
        return dict(kept_fields(self.program, dict(self.board.fields)["known"].record))

    def keeps_given(self, name: str) -> bool:
        """Whether the computer takes over what is handed in by a name, as `KNOWN` has it."""
        return self.program.keeps(_GIVEN.record, name)


def find_computer(scenario: Scenario) -> OnBoard:
    """The computer of a scenario as the simulation flies it, laws in plain Python included."""
    blocks = make_blocks(scenario)
    table, modes = modes_for(scenario, blocks)
    needs = collect_needs(blocks) | signals_need(scenario)
    oldest_s = oldest_readings_s(scenario, timetable_for(scenario, needs))
    table, selection = table._replace(oldest_s=oldest_s), make_selection(scenario, oldest_s)
    estimator = estimator_numbers(scenario, blocks)["estimator"]
    made = on_board.make_computer(_all_plain(blocks), estimator, table, selection, is_flown=False)
    adapters = tuple(
        _adapter(number, name, block, _key_of(scenario, name, block))
        for number, (name, block) in enumerate(blocks.by_key().items())
    )
    computer = {
        "laws": adapters[: len(blocks.laws)], "estimators": adapters[len(blocks.laws) :],
        "law_blocks": _number_blocks(made.law_blocks),
        "estimator_blocks": _number_blocks(made.estimator_blocks), "modes": table,
        "switch": _switches(table), "estimator": estimator, "host": 0, "selection": selection,
        "select": (on_board._select,) if len(selection.kinds) else (),
    }  # fmt: skip
    board = first_board(blocks, modes, estimator, selection)
    gate = make_gate(scenario, blocks, needs, oldest_s)
    mark = make_fingerprint(made, blocks)
    return OnBoard(scenario, blocks, computer, board, gate, needs, mark, made)


def _all_plain(blocks: Blocks) -> Blocks:
    """The blocks for their places alone: nothing is compiled."""
    return Blocks(
        {name: replace(law, compiled=False) for name, law in blocks.laws.items()},
        {name: replace(each, compiled=False) for name, each in blocks.estimators.items()},
    )


def _number_blocks(rows: np.ndarray) -> np.ndarray:
    """The rows of blocks, with a function of its own for each."""
    rows = rows.copy()
    rows["function"] = range(len(rows))
    return rows


def _switches(table) -> tuple:
    """Functions that switch the modes and check sensors, as `Computer.switch` has them."""
    if not len(table.regions):
        return ()
    checks = (on_board._check,) if table.is_checked else ()
    return (on_board._switch_modes, *checks)


def _key_of(scenario: Scenario, name: str, block: Block) -> str:
    """The key of a law or an estimator in the scenario."""
    control = scenario.control
    if block.kind.name == "law":
        return f"control.{control.key_of(name)}"
    return f"control.estimators.{name}" if name in control.estimators else "control.estimator"


def _adapter(number: int, name: str, block: Block, key: str) -> FunctionType:
    """A block as the control step calls it: `blocks.adapter` without the compiler.

    A user's that has failed answers with nothing; in the simulation the run would end.
    """
    plain = adapter._plain_adapter if block.is_built_in else adapter._guarded_adapter
    parameters, names = block.parameters, memory_names(block.memory)
    kind = find_type(floats(parameters)) if parameters else None
    cells = Array((len(block.first_memory()),))
    memory = Cast(cells if names is None else _memory_type(block, names))
    unify = block.kind.unify
    if not block.is_built_in:
        unify = block.kind.checked or unify
    parts = {
        "_failed": Failed(number, block.kind.answer),
        "_function": block.function, "_inputs": adapter._first_record, "_unify": unify,
        "_named": Cast(kind if isinstance(kind, Tuple) else None), "_cells": memory,
    }  # fmt: skip
    globals_ = {**plain.__globals__, **parts}
    made = FunctionType(plain.__code__, globals_, f"{block.kind.name}_{name}")
    made.__dict__["key"] = key
    return made


def _memory_type(block: Block, names: tuple) -> Record:
    """The memory of a block by its names."""
    fields = tuple((name, Array(shape) if shape else REAL) for name, shape in names)
    return Record(f"{plain_function(block.function).__name__}_memory", fields)


def translate_step(computer: OnBoard, again: int = 2, is_pruned: bool = True) -> Export:
    """The translation of the control step; `Refused` where a kernel cannot be translated.

    `again`: how often it is made again with what is known of indices: see `translate_repeatedly`.
    `is_pruned`: without what nothing reads, for which it is made a few times more.
    """
    of_computer = constants_type("Computer", computer.computer)
    board, now = board_type(computer.board), Rows(make_record("GateNow", gates.GATE_NOW), 1)
    state = Record("OnBoard", (("board", board), ("gate", now)))
    kinds: dict[str, Type] = {
        "computer": of_computer, "board": board, "gate_now": now,
        "inputs": _GIVEN, "region": INT, "mode": INT, "flag": INT, "place": INT, "on": BOOL,
        "value": REAL, "shift_s": TIME if is_single() else REAL, "law": INT,
        "q": Tuple((REAL,) * 4), **dict.fromkeys(("omega", "r", "v"), Tuple((REAL,) * 3)),
    }  # fmt: skip

    called = (*_ENTRIES, *((to_orbital_frame,) if "ephemeris" in computer.needs else ()))
    answer = find_type(gates.Answer((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0, NO_COMMAND))
    assert answer is not None
    looked_at = _fields_around((state, _GIVEN), computer)

    def build(program: Program) -> None:
        kinds["gate"] = constants_type("Gate", _checks(computer, program)._asdict(), True)
        program.pruned = _record_names((state, _GIVEN))
        program.name_interface((of_computer, kinds["gate"], state, _GIVEN, answer))
        for kernel in called:
            _entry(program, kernel, kinds)

    def read(program: Program) -> Reads:
        return _find_reads(program, [_entry(program, each, kinds) for each in called], looked_at)

    times = _TIMES if is_single() else ()
    try:
        find_reads = read if is_pruned else None
        program = translate_repeatedly(build, _replace(computer), again, times, "", find_reads)
    except Refused as refused:
        has_modes = bool(len(computer.board.modes.regions))
        refused.key = refused.key or ("control.modes" if has_modes else "control")
        raise
    entries = {plain_function(each).__name__: _entry(program, each, kinds) for each in called}
    of_gate = kinds["gate"]
    assert isinstance(of_gate, Record)
    return Export(program, entries, of_computer, of_gate, state, _checks(computer, program))


def _find_reads(program: Program, entries: list[Function], looked_at: set[str]) -> Reads:
    """What the functions that are reached read, and what is looked at from outside."""
    found = Reads(fields=set(looked_at))
    reached = reached_names(program, tuple(each.name for each in entries))
    for each in program.functions.values():
        if each.name in reached:
            found.add(each.reads)
            found.fields |= {"Board.failures"} if each.reports else set()
    step = plain_function(on_board.control_step)
    names = [made.name for (plain, *_), made in program.functions.items() if plain is step]
    of_step = reached_names(program, tuple(names))
    for each in program.functions.values():
        for root, left in _ROWS if each.name in of_step else ():
            found.add_cells(*_USED, each.reads.cells.get((root, left), set()))
    return found


def _checks(computer: OnBoard, program: Program) -> gates.Gate:
    """What the gate checks by, of the readings and the ephemeris that the control step uses."""
    if program.live is None:
        return computer.gate
    rows, ephemeris = computer.gate.readings, computer.gate.ephemeris.copy()
    used = program.live.cells.get(_USED, set())
    for name, fields in gates.EPHEMERIS_PARTS.items():
        ephemeris[name] = any(f"Known.{each}" in program.live.fields for each in fields)
    is_used = any(ephemeris[name].any() for name in gates.EPHEMERIS_PARTS)
    return computer.gate._replace(
        readings=rows[np.isin(rows["row"], [*used])],
        ephemeris=ephemeris if is_used else ephemeris[:0],
    )


def _fields_around(kinds: tuple[Type, ...], computer: OnBoard) -> set[str]:
    """Fields of records that are looked at from outside: by the texts around the kernels, and by
    the record of a run if there is an estimator.
    """
    words = words_around()
    found = {f"{each.name}.{name}" for each in _records(kinds) for name, _ in each.fields
             if name in words}  # fmt: skip
    if on_board.estimates(computer.made):
        found |= {f"Known.{name}" for name in _ESTIMATE}
    return found | {"Board.parameters", "Board.memory"}


def _records(kinds: Iterable[Type]) -> list[Record]:
    """All records in types."""
    records = [each.record if isinstance(each, Rows) else each for each in kinds]
    found = [each for each in records if isinstance(each, Record) and each != FAILURES]
    return found + [part for each in found for part in _records(kind for _, kind in each.fields)]


def _record_names(kinds: tuple[Type, ...]) -> set[str]:
    """Names of records of which what nothing reads is left out; modes are recorded as a whole."""
    modes = [kind for each in _records(kinds) for _, kind in each.fields if _is_modes(kind)]
    return {each.name for each in _records(kinds)} - {each.name for each in _records(modes)}


def _is_modes(kind: Type) -> bool:
    """Whether a type is the state of modes, of which there are some."""
    if not isinstance(kind, Record) or kind.name != "ModesNow":
        return False
    return dict(kind.fields)["regions"].count > 0


def _entry(program: Program, kernel: Callable, kinds: dict[str, Type]) -> Function:
    arguments = inspect.signature(plain_function(kernel)).parameters
    return program.function(kernel, [kinds[name] for name in arguments])


def _replace(computer: OnBoard) -> dict:
    """Kernels that are called in another way: signals, of those that the conditions use, by number;
    whether a vector is finite as the processor finds it out soonest."""
    used = sorted(set(computer.computer["modes"].conditions["signal"].tolist()))
    functions = [each.function for each in signals.SIGNALS.values()]

    def signal(s, node, values: list[Value]) -> Value:
        number, *rest = values
        chosen = {each: functions[each] for each in used}
        return call_switch(s, node, chosen, number, rest, constant(math.nan))

    def doubt(s, node, values: list[Value]) -> Value:
        vector = at_hand(s, values[0])
        parts = [as_real(select_part(vector, k)) for k in range(3)]
        s.program.helpers.add("doubt_of_three")
        return call_function("doubt_of_three", parts, REAL)

    replaced = {
        plain_function(signals.signal_value): signal,
        plain_function(vec3.doubt_of): doubt,
    }
    if not computer.blocks.estimators:
        replaced[plain_function(on_board.estimate_step)] = lambda s, node, values: Value(
            "", NOTHING
        )
    return replaced
