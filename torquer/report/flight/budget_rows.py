"""The torque budget as a table: names, numbers in one unit."""

import numpy as np

from torquer.analysis.budget import NAMES, Budget, budget_rows, models_as_plain
from torquer.base.language import message
from torquer.environment.ephemeris import ModelErrors
from torquer.report.common.scales import choose_prefix

HEAD = (
    *("", message("mean x"), "y", "z", message("RMS x"), "y", "z", message("RMS")),
    *(message("greatest"), message("of coils")),
)


def budget_table(budget: Budget) -> tuple[str, list[tuple[str, ...]]]:
    """(Unit, rows below `HEAD`): mean and RMS about the body axes, RMS and greatest size, and the
    RMS size as a share of the mean torque that the coils can give. The unit suits disturbances:
    the coils' torque is some hundred times as great."""
    rows = budget_rows(budget)
    sizes = [row.greatest_size_n_m for name, row in rows.items() if name != "coils"]
    factor, unit = choose_prefix(np.array(sizes), "N m")
    table = []
    for name, row in rows.items():
        numbers = (*row.mean_n_m, *row.rms_n_m, row.rms_size_n_m, row.greatest_size_n_m)
        share = "" if row.share is None else f"{_show(100.0 * row.share)} %"
        table.append((message(NAMES[name]), *(_show(factor * number) for number in numbers), share))
    return unit, table


def _show(number: float) -> str:
    """Three digits, and no more than three decimals."""
    if 0.0 < abs(number) < 5e-4:
        return "0.000"
    return f"{number:.3g}"


def models_in_words(models: ModelErrors | None) -> str:
    """Errors of the models on board, in a line; "" where they are the truth."""
    if models is None:
        return ""
    plain = models_as_plain(models)
    return (
        f"The models on board differ from the truth by {plain['field_nt']:.3g} nT and "
        f"{plain['angle_deg']:.2g} deg of the field (strength {plain['strength_nt']:.3g} nT), "
        f"{plain['position_km']:.3g} km of the position (rms); this does not average out."
    )


def reach_in_words(budget: Budget) -> str:
    """What the coils can give across the field, in a line; "" without coils."""
    if (reach := budget.available) is None:
        return ""
    factor, unit = choose_prefix(reach, "N m")
    mean, least = factor * reach.mean(), factor * reach.min()
    return message(
        "The coils can give {mean:.3g} {unit} on average in any direction across the field, "
        "{least:.3g} {unit} at least.",
        mean=mean,
        least=least,
        unit=unit,
    )
