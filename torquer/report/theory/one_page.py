"""What stands on the page of a design."""

import math
from collections.abc import Sequence
from dataclasses import fields

from torquer.analysis.citations import OWN, Source, select_sources, source_table
from torquer.analysis.verdict import clock_text
from torquer.base.rows import Row, cells_of
from torquer.design.coil_design import CoilSizes
from torquer.design.gain_sweep import GainSweep
from torquer.design.gyro.answer import GyroDesign
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.report.common.keys import value_in_words
from torquer.report.common.models import model_rows
from torquer.report.common.one_page import Page, Plot
from torquer.report.theory.designs import GainMap, draw_coils, draw_design, draw_gains
from torquer.report.theory.magneto_gyro import draw_errors, draw_flights, draw_wheels
from torquer.scenario.keys import key_unit, key_words
from torquer.scenario.spec import Scenario


def gain_page(sweep: GainSweep) -> Page:
    """Of gains of B-dot."""
    wanted = sweep.wanted
    within = "" if wanted.within_s is None else f" within {clock_text(wanted.within_s)}"
    return Page(
        title=sweep.scenario.name,
        question=(
            f"Which gain of B-dot brakes {math.degrees(wanted.tip_off_rad_s):.3g} deg/s to below "
            f"{sweep.below_deg_s:.3g} deg/s{within}?"
        ),
        verdict=". ".join(sweep.words()[:2]) + ".",
        look="open" if sweep.verdict.doubts else "done",
        plots=[Plot(lambda part: draw_gains(sweep, part))],
        numbers=(),
        table=cells_of(sweep.table()),
        models=model_rows(sweep.scenario),
        sources=_sources(sweep.scenario),
        notes=[
            *(f"theory: {line}" for line in sweep.verdict.lines()),
            *sweep.words()[2:],
            *sweep.notes(),
        ],
    )


def three_axis_page(answer: ThreeAxisAnswer, over: GainMap | None = None) -> Page:
    """Of gains that hold three axes by coils; `over`: the map of the plot, if it is there."""
    doubtful = [name for name in answer.candidates if answer.verdict_on(name).doubts]
    headline, *_ = answer.lines()
    return Page(
        title=answer.scenario.name,
        question="Which gains hold three axes by coils alone?",
        verdict=" ".join(f"{line}." for line in answer.words()[:2]),
        look="open" if doubtful else "done",
        plots=[Plot(lambda part: draw_design(answer, over, part))],
        numbers=(),
        table=cells_of(answer.table()),
        models=model_rows(answer.scenario),
        sources=_sources(answer.scenario),
        notes=[*answer.verdicts(), headline, *answer.words()[2:], *answer.notes()],
    )


def gyro_page(made: GyroDesign) -> Page:
    """Of a magneto-gyroscopic system."""
    flights = made.flights
    errors = Plot(lambda part: draw_errors(made, "Pointing error by cause", part))
    other = (
        Plot(lambda part: draw_wheels(made, "Which wheel?", part), 2.2)
        if flights is None
        else Plot(lambda part: draw_flights(made, flights, "From tip-off to pointing", part))
    )
    rows = [(row.label, f"{row.text} {row.unit}".strip()) for row in made.rows() if row.text]
    first, *doubts = made.verdict.lines()
    return Page(
        title=made.case.scenario.name,
        question=(
            f"Which gains point the satellite from {made.case.tip_off_deg_s:.3g} deg/s with a "
            "magnetometer, coils and a pitch wheel?"
        ),
        verdict=f"Design {first}; {made.time_in_words()}.",
        look="open" if made.verdict.doubts else "done",
        plots=[other, errors],
        numbers=[*_pairs(made.times()), *_pairs(made.errors_table()), *rows],
        models=model_rows(made.scenario),
        sources=_sources(made.scenario),
        notes=[*doubts, *made.notes],
    )


def coil_page(answer: CoilSizes) -> Page:
    """Of a coil."""
    asked = answer.request
    given = [(key_words(x.name), getattr(asked, x.name), key_unit(x.name)) for x in fields(asked)]
    own = Source(OWN, source_table()["source"][OWN], ())
    return Page(
        title="Magnetorquer with a core" if asked.core() else "Magnetorquer without a core",
        question=f"Which wire gives {asked.dipole_a_m2:g} A m² with {asked.mass_kg:g} kg?",
        verdict=answer.lines()[0],
        look="open",
        plots=[Plot(lambda part: draw_coils(answer, part))],
        numbers=[(row.label, f"{row.text} {row.unit}".strip()) for row in answer.core_rows()],
        table=cells_of(answer.table()),
        models=[
            (words.capitalize(), f"{value_in_words(value)} {unit}".strip(' "'))
            for words, value, unit in given if value is not None
        ],
        sources=[own.in_words()],
    )  # fmt: skip


def _pairs(table: Sequence[Sequence[Row]]) -> list[tuple[str, str]]:
    """Each entry of a table as a row: its first cell, then all others with labels and units."""
    return [
        (_cell(first), "; ".join(map(_cell, rest)))
        for first, *rest in ([row for row in entry if row.text] for entry in table)
    ]


def _cell(row: Row) -> str:
    return " ".join(filter(None, (row.label, row.text, row.unit)))


def _sources(scenario: Scenario) -> list[str]:
    return [source.in_words() for source in select_sources(scenario)]
