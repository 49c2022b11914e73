"""From the cells of columns to quantities in SI, axes and components in order."""

from __future__ import annotations

import numpy as np

from torquer.ground.telemetry.reading.cells import NumberCells, read_numbers, split_cell_numbers
from torquer.ground.telemetry.reading.mapping import Mapping, names_in
from torquer.ground.telemetry.reading.noteworthy import name_rows
from torquer.ground.telemetry.reading.quantities import COLUMNS, in_si, parse_unit, units_for
from torquer.ground.telemetry.reading.table import Finding, Table

#: Up to this part of the cells of a column may be no numbers: they are missing, and reported.
_FEW_ODD = 0.05


class Cells:
    """The cells of a table, read by a mapping; `notes`: what was noteworthy."""

    def __init__(self, table: Table, mapping: Mapping):
        self._table, self._mapping = table, mapping
        self.notes: list[Finding] = []

    def numbers(self, column: str) -> NumberCells:
        """The numbers of a column; ValueError where more than a few cells hold none."""
        mapping, cells = self._mapping, self._table.data[column]
        found = read_numbers(cells, mapping.missing, mapping.decimal)
        self._note_odd(column, found.odd, "numbers")
        return found

    def quantity(self, name: str) -> np.ndarray:
        """Values of a quantity [n] or [n, k], SI, axes and components in order."""
        quantity, values = COLUMNS[name], self._in_si(name)
        if quantity.dimension == "component":
            if self._mapping.order.get(name, "xyzw") == "wxyz":
                values = values[:, [1, 2, 3, 0]]
            inverse = name in self._mapping.inverse
            return values * ([-1.0, -1.0, -1.0, 1.0] if inverse else 1.0)
        if quantity.dimension == "axis":
            return _on_axes(values, names_in(self._mapping.order.get(name, ["x", "y", "z"])))
        if quantity.dimension == "cell" and values.shape[1] < quantity.size:
            return np.pad(values, ((0, 0), (0, quantity.size - values.shape[1])))
        return values if quantity.dimension else values[:, 0]

    def _in_si(self, name: str) -> np.ndarray:
        """Values [n, k] in SI, in the order of the columns."""
        quantity, mapping = COLUMNS[name], self._mapping
        columns = names_in(mapping.columns[name])
        unit = parse_unit(mapping.units.get(name, quantity.units))
        self._compare_unit(name, unit, columns)
        if name in mapping.split or len(columns) < min(quantity.size, 2):
            values, beside = self._joined(name, columns[0], quantity.size), None
        else:
            cells = [self.numbers(column) for column in columns]
            values = np.stack([each.values for each in cells], axis=1).astype(float)
            beside = [each.units for each in cells]
        values = np.asarray(mapping.scale.get(name, 1.0)) * values
        values = values + np.asarray(mapping.offset.get(name, 0.0))
        stated = in_si(name, unit, values)
        if beside is None:
            return stated
        self._compare_cells(name, unit, beside)
        return _by_cell(name, values, stated, beside)

    def _joined(self, name: str, column: str, size: int) -> np.ndarray:
        mapping, sign = self._mapping, self._mapping.split.get(name)
        cells = self._table.data[column]
        values, odd = split_cell_numbers(cells, sign, size, mapping.missing, mapping.decimal)
        said = "" if sign is None else f" separated by {sign!r}"
        self._note_odd(column, odd, f"{size} numbers{said}")
        return values

    def _compare_unit(self, name: str, unit: str, columns: list[str]) -> None:
        stated = parse_unit(self._table.units.get(columns[0], ""))
        if stated in units_for(name) and stated != unit and COLUMNS[name].units != "1":
            text = f"units.{name} is {unit}, as stated; the file says {stated}"
            self.notes.append(Finding("another unit in the file", 0, text))

    def _compare_cells(self, name: str, unit: str, beside: list[np.ndarray | None]) -> None:
        """Note the rows in which a cell has another unit than the mapping, as its own is used."""
        columns = [each for each in beside if each is not None]
        if not columns:
            return
        cells = np.stack(columns, axis=1)
        other = (cells != "") & (cells != unit)
        if other.any():
            rows, units = int(other.any(axis=1).sum()), ", ".join(sorted(set(cells[other])))
            text = f"units.{name} is {unit}, but cells of {rows} rows say {units}, which is used"
            self.notes.append(Finding("another unit in the cells", rows, text))

    def _note_odd(self, column: str, odd: np.ndarray, what: str) -> None:
        rows = np.flatnonzero(odd)
        if not len(rows):
            return
        first = str(self._table.data[column].iloc[rows[0]])[:60]
        if len(rows) > _FEW_ODD * len(odd):
            raise ValueError(
                f"{column}: must hold {what}; received {first!r} in row {rows[0] + 1} "
                "(`missing` lists texts that stand for none, `decimal` the sign, `split` what "
                "separates joined numbers)"
            )
        text = f"{column}: {name_rows(rows)} no number but {first!r}: taken for missing"
        self.notes.append(Finding("no numbers", len(rows), text))


def _by_cell(name: str, values, stated, beside) -> np.ndarray:
    """Values in SI, those with a unit in their cells by it."""
    known = units_for(name)
    for k, units in enumerate(beside):
        for unit in () if units is None else set(units) - {""}:
            if unit not in known:
                raise ValueError(
                    f"{name}: must have units of {', '.join(known)} in its cells; received {unit!r}"
                )
            rows = units == unit
            stated[rows, k] = in_si(name, unit, values)[rows, k]
    return stated


def _on_axes(values: np.ndarray, order: list[str]) -> np.ndarray:
    found = np.empty_like(values)
    for k, axis in enumerate(order):
        found[:, "xyz".index(axis[-1])] = -values[:, k] if axis[0] == "-" else values[:, k]
    return found
