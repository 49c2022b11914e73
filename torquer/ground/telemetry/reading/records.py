"""Text that names each number itself: JSON, JSON lines, InfluxDB's line protocol."""

from __future__ import annotations

import json
import re

_PROTOCOL = re.compile(
    r"^(?:\\.|[^,\s\\#])+(?:,(?:\\.|[^=\s\\])+=(?:\\.|[^,\s\\])+)* "
    r'(?:[^=\s]+=(?:"[^"]*"|[^,\s]+),?)+ \d{9,19}$'
)
_FIELD = re.compile(r'([^=,\s]+)=("[^"]*"|[^,\s]+)')


def is_json(text: str) -> bool:
    """Whether a text is JSON, or has JSON in its lines."""
    return bool(re.match(r'\s*(\{\s*["}]|\[\s*[\[{])', text))


def is_protocol(lines: list[str]) -> bool:
    """Whether lines are InfluxDB's line protocol."""
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return bool(_PROTOCOL.match(first.strip()))


def json_records(text: str) -> tuple[list[dict], int]:
    """Flat records of JSON, and how many lines were cut off; ValueError for what holds none."""
    try:
        whole = json.loads(text)
    except RecursionError:
        raise ValueError("FILE: must be JSON of a few levels; received more") from None
    except ValueError:
        return _records_of_lines([line for line in text.split("\n") if line.strip()])
    found = _records_in(whole)
    if not found:
        raise ValueError("FILE: must be JSON with a list of records; received none")
    return [_flat(each) for each in found], 0


def _records_of_lines(lines: list[str]) -> tuple[list[dict], int]:
    found: list[dict] = []
    for number, line in enumerate(lines, 1):
        try:
            record = json.loads(line)
        except (ValueError, RecursionError):
            record = None
        if isinstance(record, dict):
            found.append(_flat(record))
        elif number < len(lines) or not found:
            raise ValueError(
                f"FILE: must hold JSON in each line; received {line[:60]!r} in line {number}"
            )
    return found, len(lines) - len(found)


def _records_in(whole) -> list[dict]:
    """Records of a document: a list of them, columns by name, or the results of InfluxDB."""
    if isinstance(whole, list):
        return [each for each in whole if isinstance(each, dict)]
    if "columns" in whole and isinstance(whole.get("values"), list):
        return [dict(zip(whole["columns"], row, strict=False)) for row in whole["values"]]
    lists = {name: each for name, each in whole.items() if isinstance(each, list)}
    rows = {len(each) for each in lists.values()}
    if len(lists) > 1 and len(rows) == 1 and not any(_holds_tables(e) for e in lists.values()):
        return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]
    inner = [_records_in(each) for each in lists.values() if _holds_tables(each)]
    if inner and len(inner[0]) == 1 and "columns" not in inner[0][0]:
        return _records_in(inner[0][0]) or inner[0]
    if inner and inner[0] and "columns" in inner[0][0]:
        return [record for each in inner[0] for record in _records_in(each)]
    return inner[0] if inner else [whole]


def _holds_tables(given) -> bool:
    return bool(given) and all(isinstance(each, dict) for each in given)


def _flat(record: dict, above: str = "") -> dict:
    """A record without tables in it: {"mag": {"x": 1}} as {"mag.x": 1}; lists stay, and are spread
    as mag.0, mag.1 too."""
    found: dict = {}
    for name, value in record.items():
        key = f"{above}{name}"
        if isinstance(value, dict):
            found |= _flat(value, f"{key}.")
            continue
        found[key] = value
        if isinstance(value, list) and len(value) <= 16:
            found |= {f"{key}.{k}": each for k, each in enumerate(value)}
    return found


def protocol_records(lines: list[str]) -> list[dict]:
    """Records of InfluxDB's line protocol: tags and fields, `time` in ns since 1970."""
    found = []
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        if not _PROTOCOL.match(line.strip()):
            raise ValueError(
                f"FILE: must be line protocol throughout; received {line[:60]!r} in line {number}"
            )
        head, fields, stamp = re.split(r"(?<!\\) ", line.strip(), maxsplit=2)
        record: dict = dict(_FIELD.findall(head.partition(",")[2]))
        for name, value in _FIELD.findall(fields):
            record[name] = re.sub(r"(?<=\d)[iu]$", "", value.strip('"'))
        found.append(record | {"time": stamp})
    return found
