"""The keys of a mapping, described for `torquer explain mapping` and the documentation."""

from torquer.ground.telemetry.reading.epochs import DATES, ORIGINS, TICKS, YEARS
from torquer.ground.telemetry.reading.mapping import Mapping
from torquer.ground.telemetry.reading.quantities import COLUMNS, units_for
from torquer.scenario.described import Table
from torquer.scenario.keys import spec_tables

#: Where the keys stand for `torquer explain`.
PLACE = "mapping"


def mapping_tables() -> list[Table]:
    """The tables of a mapping; formats of stamps and quantities are listed with their keys."""
    more = {"time_format": _formats_said(), "columns": _quantities_said()}
    return [
        table._replace(
            keys=[
                key._replace(description=" ".join(filter(None, (key.description, more[key.name]))))
                if key.name in more
                else key
                for key in table.keys
            ]
        )
        for table in spec_tables(Mapping, PLACE)
    ]


def format_rows() -> list[tuple[str, str, str, str]]:
    """Counted formats of stamps: name, UTC of its zero, whether leap seconds are counted, what."""
    rows = [
        (f"{name}_TICK", each.start or "`epoch`", _leaps(each.counts_leaps), each.meaning)
        for name, each in ORIGINS.items()
    ]
    rows += [
        (name, f"{each.start} is {each.first:.10g}", _leaps(each.counts_leaps), each.meaning)
        for name, each in DATES.items()
    ]
    return rows + [(name, "", "", meaning) for name, meaning in YEARS.items()]


def quantity_rows() -> list[tuple[str, str, str, str]]:
    """Quantities: name, columns, units, what they are."""
    return [
        (name, str(each.size), ", ".join(units_for(name)), each.meaning)
        for name, each in COLUMNS.items()
    ]


def _leaps(counted: bool) -> str:
    return "counted" if counted else "left out"


def _formats_said() -> str:
    origins = [f"{name} ({each.meaning})" for name, each in ORIGINS.items()]
    dates = ", ".join([*DATES, "year_day"])
    first, others = (", ".join(part) for part in (origins[:7], origins[7:]))
    return f"Origins: {first}. Others: {others}. Ticks: {', '.join(TICKS)}. Dates: {dates}."


def _quantities_said() -> str:
    return f"Quantities: {', '.join(COLUMNS)}."
