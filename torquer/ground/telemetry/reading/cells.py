"""Numbers as people write them: decimal commas, digits in groups of three, units beside them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from torquer.ground.telemetry.reading.quantities import UNITS, parse_unit

#: Units that may stand beside numbers.
KNOWN_UNITS = {unit for units in UNITS.values() for unit in units}
#: Signs that may stand between groups of three digits, besides the one that is not decimal.
_GROUPING = "'\u2019\u00a0\u202f "
_NUMBER = r"^([-+]?[\d.,'\u2019\u00a0\u202f ]*\d[.,]?(?:[eE][-+]?\d+)?)\s*([^\d\s].*)?$"


class NumberCells(NamedTuple):
    """Numbers of a column [n], NaN where there is none; units beside them [n] or None; rows whose
    cells are neither numbers nor missing."""

    values: np.ndarray
    units: np.ndarray | None
    odd: np.ndarray


def cell_texts(column):
    """The cells of a column as texts, "" where there is none."""
    import pandas as pd

    if isinstance(column.dtype, pd.StringDtype):
        return column.fillna("").str.strip()
    missing = column.isna()
    return column.astype(object).where(~missing, "").astype(str).str.strip()


def read_numbers(column, missing: tuple[str, ...], decimal: str | None) -> NumberCells:
    """Numbers of the cells of a column; `decimal`: "." or ",", None: the cells tell.

    ValueError where they do not: 14,954 may be 14.954 and 14954.
    """
    import pandas as pd

    none = pd.Series(missing, dtype=object)
    absent = [float(each) for each in missing if _is_number(each)]
    if pd.api.types.is_bool_dtype(column):
        column = column.astype(float)
    if pd.api.types.is_numeric_dtype(column):
        values = column.to_numpy()
        if column.isna().any() or np.isin(values, absent).any():
            values = np.where(np.isin(values, absent), np.nan, column.to_numpy(dtype=float))
        return NumberCells(values, None, np.zeros(len(values), dtype=bool))
    text = cell_texts(column)
    blank = text.isin(none) | (text == "")
    text = text.str.replace("\u2212", "-")
    numbers = pd.to_numeric(text.where(~blank, "nan"), errors="coerce")
    plain = np.array(numbers, dtype=float)
    rest = (np.isnan(plain) & ~blank & (text.str.lower() != "nan")).to_numpy(copy=True)
    units = None
    if decimal == ",":  # 1.234 is grouped
        rest |= text.str.contains(".", regex=False).to_numpy() & ~blank.to_numpy()
    if rest.any():
        parts = text[rest].str.extract(_NUMBER)
        unit = parts[1].fillna("").map(parse_unit)
        numbers = parts[0].where(unit.isin(KNOWN_UNITS))
        plain[rest] = _written(numbers, decimal).to_numpy(dtype=float)
        if parts[1].notna().any():
            units = np.full(len(text), "", dtype=object)
            units[rest] = unit.where(parts[1].notna() & unit.isin(KNOWN_UNITS), "")
    plain[np.isin(plain, absent)] = np.nan
    return NumberCells(plain, units, rest & np.isnan(plain))


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _written(text, decimal: str | None):
    """Numbers of texts that Python does not read as such; NaN for what is none."""
    import pandas as pd

    sign = decimal or _find_decimal(text.dropna())
    other = "." if sign == "," else ","
    groups = f"[{_GROUPING}{other}]"
    whole = rf"[-+]?(?:\d+|\d{{1,3}}(?:{groups}\d{{3}})+)?"
    fits = text.str.fullmatch(rf"{whole}(?:[{sign}]\d*)?(?:[eE][-+]?\d+)?").fillna(False)
    bare = text.str.replace(groups, "", regex=True).str.replace(sign, ".", regex=False)
    return pd.to_numeric(bare.where(fits.astype(bool)), errors="coerce")


def _find_decimal(text) -> str:
    """The decimal sign that the texts leave; ValueError if they leave both."""
    comma = text[text.str.contains(",", regex=False)]
    if not len(comma):
        return "."
    both = comma[comma.str.contains(".", regex=False)]
    if len(both):
        return "," if (both.str.rfind(",") > both.str.rfind(".")).all() else "."
    digits = r"[-+]?\d{1,3}(?:,\d{3})+"
    if not comma.str.fullmatch(digits).all():
        return ","
    if comma.str.count(",").max() > 1 or text.str.contains(".", regex=False).any():
        return "."
    raise ValueError(
        f'decimal: must be given, as "," or ".", for numbers such as {comma.iloc[0]!r}; received '
        "none"
    )


def split_cell_numbers(column, sign: str | None, size: int, missing, decimal):
    """Numbers [n, size] that are joined in the cells of a column; rows that hold others.

    `sign`: what stands between them; None: found, of lists in brackets.
    """
    found = np.full((len(column), size), np.nan)
    odd = np.zeros(len(column), dtype=bool)
    for row, cell in enumerate(column):
        if isinstance(cell, list | tuple | np.ndarray):
            parts: list = list(cell)
        else:
            text = "" if cell is None or cell != cell else str(cell).strip()
            if text in missing or not text:
                continue
            parts = _parts(text.strip("[](){}<>\"'").strip(), sign, decimal)
        numbers = [_as_number(part, missing, decimal) for part in parts]
        if len(numbers) != size or None in numbers:
            odd[row] = True
        else:
            found[row] = numbers
    return found, odd


def _parts(text: str, sign: str | None, decimal: str | None) -> list[str]:
    if sign is not None:
        return text.split(None if sign == " " else sign)
    for each in ";" if decimal == "," else ",;":
        text = text.replace(each, " ")
    return text.split()


def _as_number(part, missing, decimal: str | None) -> float | None:
    if part is None or (isinstance(part, str) and part.strip() in missing):
        return np.nan
    text = str(part).strip().replace("\u2212", "-")
    if decimal == ",":
        text = text.replace(".", "").replace(",", ".")
    try:
        return float(text)
    except ValueError:
        return None
