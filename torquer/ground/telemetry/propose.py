"""A mapping proposed for a file, and what of it is a guess."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from torquer.ground.telemetry.mapping import Mapping, make_mapping, write_mapping
from torquer.ground.telemetry.quantities import QUANTITIES, in_si, parse_unit, units_for
from torquer.ground.telemetry.read import split_numbers
from torquer.ground.telemetry.tables import find_format, read_table

#: What column names hold by quantity, in the order in which they are tried: words, anywhere, and
#: beginnings too short for that, before which and after which no further letters of a word stand.
_WORDS = {
    "b_measured": r"mag|field|(?<![a-z])b(?![a-w])",
    "omega_measured": r"omega|gyro|rate|angular|(?<![a-z])w(?![a-w])",
    "q_measured": r"quat|(?<![a-z])(att|q(?![a-v]))",
    "sun_measured": r"sun|\bs_",
    "dipole_body": r"dip|mtq|torquer|coil",
    "position_j": r"pos|eci|\br_",
    "temperature": r"temp",
}
_TIME = re.compile(r"time|date|stamp|utc|epoch", re.I)
_UNIT = re.compile(r"[\[(_ ]([^\[\]()_ ]+)[\])]?$")
#: Usual strengths in SI, with which a unit is guessed.
_USUAL = {"b_measured": 4e-5, "omega_measured": 0.01, "position_j": 7e6, "temperature": 290.0}


class Proposal(NamedTuple):
    """A mapping, and in words what of it is a guess."""

    mapping: Mapping
    guesses: list[str]

    @property
    def text(self) -> str:
        """The mapping file: guesses as comments, then its keys."""
        return write_mapping(self.mapping, self.guesses)

    def _repr_html_(self) -> str:
        """The file for a notebook."""
        return f"<pre>{escape(self.text)}</pre>"


def propose_mapping(path: Path | str) -> Proposal:
    """A mapping for a file of telemetry, to be checked and written to a file of its own.

    ValueError for no file, and where no column fits.

        print(propose_mapping("pass.csv").text)
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"FILE: must be a file; received {path}")
    kind = find_format(path)
    guesses: list[str] = []
    base: dict[str, Any] = {}
    if kind == "archive":
        base["packet"] = _packet(path, guesses)
    if kind == "text":
        base |= _layout(path, guesses)
    draft = Mapping.model_construct(**base)
    table = read_table(path, draft)
    base |= _time(table, guesses)
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    free = [c for c in map(str, table.data.columns) if c not in np.atleast_1d(base["time"])]
    for name, words in _WORDS.items():
        found = [c for c in free if re.search(words, c, re.I)]
        picked = _in_order(name, found)
        if picked is None:
            joined = _join(table, name, found)
            if joined is None:
                continue
            column, sign = joined
            columns[name] = column
            base.setdefault("split", {})[name] = sign
            guesses.append(f"{column} holds {QUANTITIES[name].size} numbers with {sign!r} between")
            picked = [column]
        else:
            columns[name] = picked if len(picked) > 1 else picked[0]
        guesses.append(f"{name} is {', '.join(picked)}")
        if QUANTITIES[name].units != "1":
            units[name] = _unit(table, name, picked, base.get("split", {}).get(name), guesses)
        free = [c for c in free if c not in picked]
    if not columns:
        raise ValueError(
            f"FILE: must have columns whose names tell what they are; received "
            f"{', '.join(free[:20])}"
        )
    if "q_measured" in columns:
        guesses.append("q_measured is body to J, scalar last: |B| does not check it")
    return Proposal(make_mapping({**base, "columns": columns, "units": units}), guesses)


def _packet(path: Path, guesses) -> str:
    from contextlib import closing

    from torquer.ground.archive import dictionary_in, read_only

    with closing(read_only(path)) as db:
        down = dictionary_in(db).down
    fits = [name for name, each in down.items() if _in_order("b_measured", list(each.names))]
    if not fits:
        raise ValueError(f"FILE: must have a packet with the field; received {', '.join(down)}")
    guesses.append(f"packet {fits[0]}, the first with three numbers of a magnetometer")
    return fits[0]


def _layout(path: Path, guesses) -> dict:
    """Lines before the head and the separator: the head is above the first row of numbers."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        lines = [file.readline() for _ in range(200)]
    lines = [line.rstrip("\r\n") for line in lines if line]
    for sign in ("\t", ";", ",", "|", " "):
        for k in range(1, len(lines)):
            row, head = (lines[j].strip().lstrip("#").strip() for j in (k, k - 1))
            parts = row.split() if sign == " " else row.split(sign)
            names = head.split() if sign == " " else head.split(sign)
            numbers = sum(bool(re.search(r"^[-+]?[\d.]", part.strip())) for part in parts)
            if len(parts) > 1 and len(parts) == len(names) and numbers > len(parts) // 2:
                if sum(bool(re.search("[A-Za-z]", n)) for n in names) < len(names):
                    continue
                separator = "whitespace" if sign == " " else sign
                if k > 1:
                    guesses.append(f"the head is line {k}")
                return {"skip": k - 1, "separator": separator}
    raise ValueError(f"FILE: must have a head that names the columns; received {path}")


def _time(table, guesses) -> dict:
    names = [c for c in map(str, table.data.columns) if _TIME.search(c)]
    if table.format == "archive":
        return {"time": "_time_ms", "time_format": "unix_ms"}
    if "utc" in table.is_utc:
        return {"time": "utc"}
    if not names:
        raise ValueError(
            "FILE: must have a column of time stamps; received "
            + ", ".join(map(str, table.data.columns[:20]))
        )
    values = table.data[names[0]]
    guesses.append(f"time is {names[0]}")
    if values.dtype.kind in "fiu":
        size = float(np.nanmedian(values))
        for form, low, high in (
            ("mjd", 3e4, 1e5), ("julian", 2e6, 3e6), ("unix_s", 1e8, 1e10),
            ("unix_ms", 1e11, 1e13), ("unix_us", 1e14, 1e16), ("unix_ns", 1e17, 1e19),
        ):  # fmt: skip
            if low <= size < high:
                guesses.append(f"its numbers are {form}")
                return {"time": names[0], "time_format": form}
        raise ValueError(f"{names[0]}: must count from a known instant; received {size:g}")
    if names[0] in table.is_utc:
        return {"time": names[0]}
    text = str(values.iloc[0])
    has_zone = bool(re.search(r"(Z|[+-]\d\d:?\d\d)$", text.strip()))
    form = "iso" if re.match(r"\d{4}-\d\d-\d\d", text) else _format(text)
    found = {"time": names[0], "time_format": form}
    if form != "iso":
        guesses.append(f"its format is {form}, day before month")
    if not has_zone:
        guesses.append("its zone is UTC: CHECK THIS, the stamps state none")
        found["zone"] = "UTC"
    return found


def _format(text: str) -> str:
    for pattern, form in (
        (r"\d{1,2}-\d{1,2}-\d{4} ", "%d-%m-%Y "), (r"\d{1,2}/\d{1,2}/\d{4} ", "%d/%m/%Y "),
        (r"\d{1,2}\.\d{1,2}\.\d{4} ", "%d.%m.%Y "), (r"\d{4}/\d{1,2}/\d{1,2} ", "%Y/%m/%d "),
    ):  # fmt: skip
        if re.match(pattern, text):
            return form + ("%H:%M:%S.%f" if "." in text.split()[-1] else "%H:%M:%S")
    raise ValueError(f"time_format: must be stated for stamps such as {text!r}")


def _in_order(name: str, found: list[str]) -> list[str] | None:
    """Columns of a quantity in the order of its axes; None if these are not all there."""
    quantity = QUANTITIES[name]
    if not quantity.dimension:
        return found[:1] or None
    want = "xyz" if quantity.dimension == "axis" else "xyzw"
    for signs in (want, "0123"[: len(want)], "1234"[: len(want)]):
        by: dict[str, str] = {}
        for column in found:
            bare = re.sub(r"[\[(].*?[\])]", "", column).strip("_ ")
            bare = re.sub(r"_(nt|ut|t|deg_s|rad_s|dps|km|m|k|degc)$", "", bare, flags=re.I)
            by.setdefault(bare[-1:].lower(), column)
        if all(sign in by for sign in signs):
            return [by[sign] for sign in signs]
    return None


def _join(table, name: str, found: list[str]):
    size = QUANTITIES[name].size
    for column in found:
        known = [text for text in table.data[column].dropna().head(20) if isinstance(text, str)]
        for sign in ("\\", ";", ",", "|", "/", " "):
            if known and all(len(re.split(re.escape(sign), t.strip())) == size for t in known):
                return column, sign
    return None


def _unit(table, name: str, columns: list[str], split, guesses) -> str:
    stated = parse_unit(table.units.get(columns[0], ""))
    if stated in units_for(name):
        return stated
    found = _UNIT.search(columns[0])
    lower = {each.lower(): each for each in units_for(name)}
    word = parse_unit(found[1]) if found else ""
    if word.lower() in lower and columns[0] != word:
        return lower[word.lower()]
    if split:
        values = split_numbers(table, columns[0], split, QUANTITIES[name].size)
    else:
        values = table.data[columns].apply(_as_numbers).to_numpy(dtype=float)
    size = float(np.nanmedian(np.linalg.norm(np.atleast_2d(values), axis=1)))
    units = units_for(name)
    usual = _USUAL.get(name, 0.1)
    best = min(
        units, key=lambda u: abs(np.log(max(float(in_si(name, u, np.array(size))), 1e-30) / usual))
    )
    guesses.append(f"the unit of {name} is {best}, by the size of its numbers")
    return best


def _as_numbers(column):
    import pandas as pd

    return pd.to_numeric(column, errors="coerce")
