"""FIELD section 3: what four field models cost, evaluated at every step and from a table.

Cost is the time of a whole run: preparing it and stepping. Turns are interleaved and the least
time of each counts, so that other load on the machine hurts all alike. With the environment's
table the stepping never sees the model.
"""

import time

import numpy as np

from gallery.drawing import COLOURS, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, consistent, within
from gallery.four_models import MODELS, Case, scenario
from torquer.simulation.setup.run import prepare

PRINTED_S = {"IGRF-14": 147.7, "tilted dipole": 33.8, "direct dipole": 15.0, "averaged": 14.8}
#: Of the first the field's computation took 128.5 s.
PRINTED_FIELD_S = 128.5
CASE = Case((60.0, 130.0, 230.0), 5e11, 0.0, 4.0, record_s=100.0)
#: Fixed steps: without a table the model is evaluated at their instants, known beforehand.
STEPS = {"revolutions": CASE.revolutions, "step_s": 1.0, "record_s": CASE.record_s}
TURNS = 40


def clocked(model: str, tolerance: float) -> tuple[float, float]:
    """Seconds to prepare a run and to step it; tolerance 0 evaluates the model at every step."""
    plain = scenario(CASE, model).replace("simulation", STEPS)
    environment = plain.environment.model_copy(update={"table_tolerance": tolerance})
    start = time.perf_counter()
    run = prepare(plain.model_copy(update={"environment": environment}))
    ready = time.perf_counter()
    run.advance_to(run.steps)
    return ready - start, time.perf_counter() - ready


def costs() -> dict[str, dict[str, float]]:
    """Least seconds by what is timed and by model: stepping from the table, whole run, exact."""
    found = {name: {model: [] for model in MODELS} for name in ("stepping", "table", "exact")}
    for _ in range(TURNS + 1):  # the first turn compiles
        for model in MODELS:
            making, stepping = clocked(model, 1e-9)
            found["stepping"][model].append(stepping)
            found["table"][model].append(making + stepping)
            found["exact"][model].append(sum(clocked(model, 0.0)))
    return {
        name: {model: min(values[1:]) for model, values in by_model.items()}
        for name, by_model in found.items()
    }


def over_direct(by_model: dict[str, float]) -> dict[str, float]:
    """Costs over that of the direct dipole."""
    return {model: value / by_model["direct dipole"] for model, value in by_model.items()}


def compute() -> Answer:
    """Ratios of costs: the source's, ours with the model at every step, ours with the table."""
    found = costs()
    printed, exact = over_direct(PRINTED_S), over_direct(found["exact"])
    stepping = found["stepping"].values()
    checks = (
        consistent(within("stepping with the table: most expensive model over cheapest",
                          "our aim: equal within 20 %", max(stepping) / min(stepping),
                          high=1.2, fleeting=True)),
        within("model at every step: IGRF over the direct dipole", "147.7 : 15 (9.8)",
               exact["IGRF-14"], low=9.75, high=9.9, fleeting=True),
    )  # fmt: skip
    bars = {"FIELD": printed, "here, model at every step": exact,
            "here, whole run with the table": over_direct(found["table"]),
            "here, its stepping alone": over_direct(found["stepping"])}  # fmt: skip
    return Answer(checks, {"": picture(bars)})


def picture(costs_by_name):
    """Bars, model by model."""
    figure, (axes,) = new_figure("Cost of a run over that with the direct dipole")
    places = np.arange(len(MODELS))
    for i, ((name, found), colour) in enumerate(zip(costs_by_name.items(), COLOURS, strict=False)):
        shift = 0.2 * (i - 1.5)
        bars = axes.bar(places + shift, list(found.values()), 0.19, color=colour, label=name)
        axes.bar_label(bars, fmt="%.1f", fontsize=8.5)
    axes.set_xticks(places, list(MODELS))
    axes.set_ylabel("cost / direct dipole", fontsize=10)
    axes.grid(False, axis="x")
    axes.legend(frameon=False, fontsize=9.5)
    return figure


ENTRY = Entry(
    ids=("FIELD-cost",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "here even IGRF at every step adds about a third to a run (FIELD: 87 % of it was the "
        "field). It is compiled, evaluated for all instants at once, and shared by the stages of "
        "a step. With the environment's table the stepping costs the same under every model"
    ),
    slow=True,
)
