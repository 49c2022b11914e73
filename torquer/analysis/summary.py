"""Summary of a run: the key numbers, and rows of a table with them."""

import json
from html import escape

import numpy as np
import xarray as xr

from torquer.analysis.attitude import attitude_error_in, with_held
from torquer.analysis.citations import cited_in_words
from torquer.analysis.conserved import conserved_quantities, relative_drifts
from torquer.analysis.goals import SIGNALS, Goal, find_goals
from torquer.analysis.mode_use import state_uses
from torquer.analysis.series import first_at, none_if_never, stays_from
from torquer.analysis.verdict import clock_text, judge_run, judged_series
from torquer.analysis.wheel_use import AT_LIMIT, recorded_wheels, zero_crossings
from torquer.base.language import Message, joined, message, told
from torquer.base.strict_json import finite_or_none
from torquer.computer.modes.spec import MAIN
from torquer.simulation.results.dataset import COMPLETE, flown_laws, flown_scenario

#: Number of records in memory at a time.
_PART = 1 << 18
#: Conserved quantities among the series.
_CONSERVED = "conserved_"
#: Rows of the table: label, key, unit.
_ROWS = (
    ("Simulated", "simulated_s", "s"),
    ("Revolutions", "revolutions", ""),
    ("Orbital rate", "orbital_rate_deg_s", "deg/s"),
    ("Initial rate", "initial_rate_deg_s", "deg/s"),
    ("Final rate", "final_rate_deg_s", "deg/s"),
    ("  in orbital rates", "final_rate_orbital_rates", ""),
    ("Peak coil dipole", "peak_coil_dipole_a_m2", "A m²"),
    ("Coil energy", "coil_energy_j", "J"),
    ("  equivalent time at full power", "coil_full_power_s", "coil-seconds"),
    ("Initial momentum", "initial_momentum_n_m_s", "N m s"),
    ("Final momentum", "momentum_left_n_m_s", "N m s"),
    ("Peak wheel momentum, share of limit", "peak_wheel_momentum_share", "%"),
    ("  wheel", "peak_wheel_momentum_wheel", ""),
    ("  at", "peak_wheel_momentum_at_s", "s"),
    ("First wheel saturated at", "wheel_momentum_limit_reached_at_s", "s"),
    ("Peak motor torque", "peak_wheel_torque_n_m", "N m"),
    ("  share of limit", "peak_wheel_torque_share", "%"),
    ("Peak total wheel momentum", "peak_wheels_momentum_n_m_s", "N m s"),
    ("  at the end", "final_wheels_momentum_n_m_s", "N m s"),
    ("Zero crossings of wheel speed", "wheel_zero_crossings", ""),
    ("Initial attitude error", "initial_attitude_error_deg", "deg"),
    ("  at the end", "final_attitude_error_deg", "deg"),
    ("  mean over the last revolution", "mean_attitude_error_last_revolution_deg", "deg"),
    ("  peak over the last revolution", "peak_attitude_error_last_revolution_deg", "deg"),
    ("Error from the commanded attitude at the end", "final_commanded_error_deg", "deg"),
    ("  mean over the last revolution", "mean_commanded_error_last_revolution_deg", "deg"),
    ("  peak over the last revolution", "peak_commanded_error_last_revolution_deg", "deg"),
    ("Integration error, measured", "integration_error_measured_deg", "deg"),
    ("Integration error, sum of the steps' estimates", "integration_error_deg", "deg"),
    ("  mean step", "mean_step_s", "s"),
    ("  shortest step", "least_step_s", "s"),
    ("Drift of the momentum, relative", "momentum_drift", ""),
    ("Drift of the energy of rotation, relative", "energy_drift", ""),
    ("Drift of the Jacobi integral, relative", "jacobi_integral_drift", ""),
    ("Numerical damping of nutation by RK4, at most", "rk4_damping", "%"),
    ("Numerical phase lag of rotation by RK4", "rk4_lag_deg", "deg"),
    ("Relative error of the environment table, at most", "table_relative_error", ""),
)
#: Rows that are left out where there is no number: coils without a power have no energy.
_KNOWN_OR_LEFT_OUT = ("coil_energy_j",)
#: What is said where there is no number.
_WHY_NONE = {
    "initial_attitude_error_deg": message("no attitude held"),
    "final_attitude_error_deg": message("no attitude held"),
    "final_commanded_error_deg": message("no attitude held"),
}


class Summary(dict):
    """Key numbers of a run by key, unit in the key; printed as a table of labels and values."""

    def __str__(self) -> str:
        """The rows in aligned columns; the plain dictionary after keys were taken out."""
        if not {"scenario", "verdict"} <= self.keys():
            return repr(self)
        rows = told_rows(summary_rows(self))
        wide = max(len(label) for label, _ in rows)
        return "\n".join([self["scenario"], *(f"{label:{wide}}  {value}" for label, value in rows)])

    def _repr_html_(self) -> str:
        """The rows as a table of a notebook."""
        if not {"scenario", "verdict"} <= self.keys():
            return f"<pre>{escape(repr(self))}</pre>"
        cells = (
            f"<tr><td>{escape(a)}</td><td>{escape(b)}</td></tr>"
            for a, b in told_rows(summary_rows(self))
        )
        return f"<table><caption>{escape(self['scenario'])}</caption>{''.join(cells)}</table>"


def summarise(result: xr.Dataset) -> Summary:
    """Summary as plain data: value by key, unit in the key. Printed, it is a table.

    >>> torquer.summarise(result)["simulated_s"]
    600.0
    """
    scenario = flown_scenario(result)
    omega0 = scenario.orbit.rate_rad_s(scenario.start)
    goals = find_goals(scenario)
    series = (_needed_series(part, goals) for part in _parts(with_held(result)))
    t, found = result["time"].values, _join(series)
    rate, momentum, angle = found["rate"], found["momentum"], found.get("angle")
    found_numbers = {
        "scenario": scenario.name,
        "ended": result.attrs["ended"],
        **{key: result.attrs[key] for key in ("ended_by",) if key in result.attrs},
        "verdict": judge_run(scenario, goals, t, found, result.attrs["ended"] == COMPLETE),
        "simulated_s": float(t[-1]),
        "revolutions": float(t[-1] * omega0 / (2.0 * np.pi)),
        "orbital_rate_deg_s": float(np.degrees(omega0)),
        "initial_rate_deg_s": float(np.degrees(rate[0])),
        "final_rate_deg_s": float(np.degrees(rate[-1])),
        "final_rate_orbital_rates": float(rate[-1] / omega0),
        **_times_below(t, rate, omega0),
        **_summarise_coils(result, scenario.spacecraft.coils),
        "initial_momentum_n_m_s": float(momentum[0]),
        "momentum_left_n_m_s": float(momentum[-1]),
        **_summarise_wheels(t, found),
        **_summarise_attitude(t, angle, found.get("commanded"), 2.0 * np.pi / omega0),
        **_summarise_steps(result),
        **_summarise_conserved(found),
        "table_relative_error": float(result.attrs["table_relative_error"]),
        "laws": {
            key: {"name": law["name"], "runs_as": law["runs_as"]}
            for key, law in flown_laws(result).items()
        },
        **_summarise_modes(result),
        "seed": int(result.attrs["seed"]),
        "versions": json.loads(result.attrs["versions"]),
        "cite": cited_in_words(result),
    }
    return Summary(found_numbers)


def _summarise_steps(result) -> dict:
    """Error and length of adaptive steps; numerical damping and lag of RK4; error measured."""
    measured = {}
    if "integration_error_measured" in result:
        error = float(np.degrees(result["integration_error_measured"]))
        measured = {"integration_error_measured_deg": error}
    if "integration_error" in result:
        if not float(result["steps"]):
            return measured
        return measured | {
            "integration_error_deg": float(np.degrees(result["integration_error"])),
            "mean_step_s": float(result["mean_step"]),
            "least_step_s": float(result["least_step"]),
        }
    if "rk4_damping" not in result:
        return measured
    return measured | {
        "rk4_damping": float(result["rk4_damping"]),
        "rk4_lag_deg": float(np.degrees(result["rk4_lag"])),
    }


def _summarise_conserved(found: dict[str, np.ndarray]) -> dict:
    """Relative drift of what the motion conserves."""
    kept = {key: values for key, values in found.items() if key.startswith(_CONSERVED)}
    drifts = relative_drifts(kept)
    return {f"{key.removeprefix(_CONSERVED)}_drift": drift for key, drift in drifts.items()}


def _summarise_modes(result) -> dict:
    """Use of every state by region, where there are modes or a scheme."""
    uses = state_uses(result)
    if not uses:
        return {}
    return {"modes": {name: {s: use._asdict() for s, use in u.items()} for name, u in uses.items()}}


def _summarise_coils(result, coils) -> dict:
    """Use of the coils, if there are any."""
    if coils is None:
        return {}
    power_w, energy_j = coils.power_w(), float(result["coil_energy"])
    return {
        "peak_coil_dipole_a_m2": float(result["peak_coil_dipole"]),
        "coil_energy_j": energy_j if power_w else None,
        "coil_full_power_s": energy_j / (power_w or 1.0),
    }


def _parts(result: xr.Dataset):
    """The result in pieces: a long one may not fit into memory."""
    for first in range(0, result.sizes["time"], _PART):
        yield result.isel(time=slice(first, first + _PART))


def _needed_series(part: xr.Dataset, goals: list[Goal]) -> dict[str, np.ndarray]:
    """The series that the summary needs."""
    found = {
        "rate": np.linalg.norm(part["omega_body"].values, axis=1),
        "momentum": np.linalg.norm(part["momentum_inertial"].values, axis=1),
    }
    found |= {_CONSERVED + name: values for name, values in conserved_quantities(part).items()}
    scenario = flown_scenario(part)
    found |= judged_series(part, scenario, goals)
    error, wheels = attitude_error_in(part, scenario), recorded_wheels(part, scenario)
    if error is not None:
        found |= {"angle": error.angle_deg, "commanded": error.commanded_deg}
    if wheels is not None:
        found |= {
            "fullest": wheels.momentum_shares.argmax(axis=1).astype(np.int16),
            "torque": np.abs(wheels.torque).max(axis=1),
            "total": np.linalg.norm(wheels.total_body, axis=1),
            "spin_sign": wheels.spin_sign,
        }
    return found


def _join(parts) -> dict[str, np.ndarray]:
    parts = list(parts)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _summarise_wheels(t, found: dict[str, np.ndarray]) -> dict:
    """Peak shares of the wheels' limits, and their momentum at the end."""
    if "share" not in found:
        return {}
    share, total = found["share"], found["total"]
    row, full = np.argmax(share), np.flatnonzero(share > AT_LIMIT)
    return {
        "peak_wheel_momentum_share": float(share[row]),
        "peak_wheel_momentum_wheel": int(found["fullest"][row]),
        "peak_wheel_momentum_at_s": float(t[row]),
        "wheel_momentum_limit_reached_at_s": float(t[full[0]]) if full.size else None,
        "peak_wheel_torque_n_m": float(found["torque"].max()),
        "peak_wheel_torque_share": float(found["torque_share"].max()),
        "peak_wheels_momentum_n_m_s": float(total.max()),
        "final_wheels_momentum_n_m_s": float(total[-1]),
        "wheel_zero_crossings": zero_crossings(found["spin_sign"]),
    }


def _summarise_attitude(t, angle, commanded, revolution_s: float) -> dict:
    """Attitude errors, if a law held an attitude: from it, and from what it steered by slews."""
    if angle is None or np.isnan(angle).all():
        return {}
    mean, peak = _late(t, angle, revolution_s)
    found = {
        "initial_attitude_error_deg": finite_or_none(angle[0]),
        "final_attitude_error_deg": finite_or_none(angle[-1]),
        "attitude_error_stays_below_1_deg_from_s": none_if_never(stays_from(t, angle < 1.0)),
        "mean_attitude_error_last_revolution_deg": mean,
        "peak_attitude_error_last_revolution_deg": peak,
    }
    if np.isnan(commanded).all():
        return found
    mean, peak = _late(t, commanded, revolution_s)
    return found | {
        "final_commanded_error_deg": finite_or_none(commanded[-1]),
        "mean_commanded_error_last_revolution_deg": mean,
        "peak_commanded_error_last_revolution_deg": peak,
    }


def _late(t, angle, revolution_s: float) -> tuple[float | None, float | None]:
    """Mean and peak over the last revolution, where there is a whole one with numbers."""
    last = angle[t >= t[-1] - revolution_s]
    if t[-1] - t[0] < revolution_s or np.isnan(last).all():
        return None, None
    return float(np.nanmean(last)), float(np.nanmax(last))


def _times_below(t, rate, omega0) -> dict:
    """First time below 2 and 3 orbital rates, and the time from which the rate stays below."""
    times = {}
    for factor in (3, 2):
        below = rate < factor * omega0
        stays = none_if_never(stays_from(t, below))
        times[f"time_to_below_{factor}x_orbital_rate_s"] = none_if_never(first_at(t, below))
        times[f"stays_below_{factor}x_orbital_rate_from_s"] = stays
    return times


# ------------------------------------------------------------------ in words


def summary_rows(summary: dict, verdict: bool = True) -> list[tuple[str, str]]:
    """Label and value with unit for every row that applies to the satellite.

    The verdict and its limits come first, unless they are shown elsewhere.

        >>> print(dict(torquer.summary_rows(torquer.summarise(result)))["Simulated"])
        600 s (10 min)
    """
    first = _verdict_rows(summary) if verdict else []
    rows = [
        (message(label), _show(summary[key], key, unit))
        for label, key, unit in _ROWS
        if key in summary and not (key in _KNOWN_OR_LEFT_OUT and summary[key] is None)
    ]
    if "ended_by" in summary:
        first.append(("Ended early, by", summary["ended_by"]))
    return [*first, *rows, *_mode_rows(summary.get("modes", {}))]


def told_rows(rows: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Labels and values in the language of the reader."""
    return [(told(label), told(value)) for label, value in rows]


def _verdict_rows(summary: dict) -> list[tuple[str, str]]:
    """Whether the run met its goals: the verdict, and every limit."""
    verdict = summary["verdict"]
    rows: list[tuple[str, str]] = [(message("Verdict"), verdict["headline"])]
    for goal in verdict["goals"]:
        label = message(
            "{signal} below {below:.4g} {unit}: first at",
            signal=SIGNALS[goal["signal"]],
            below=goal["below"],
            unit=goal["unit"],
        )
        rows += [
            (label, time_or_never(goal["first_s"])),
            (message("  stays below from"), time_or_never(goal["stays_from_s"])),
        ]
        if goal["times_above"]:
            rows.append((message("  above it again"), _times_above(goal)))
    return rows


def _times_above(goal: dict) -> Message:
    times = message("{count} times", count=goal["times_above"])
    if not goal["within_residual"]:
        return times
    low, high = goal["residual"]
    within = message(
        "the limit lies within the residual motion, {low:.3g}..{high:.3g} {unit}",
        low=low,
        high=high,
        unit=goal["unit"],
    )
    return joined(": ", [times, within])


def _mode_rows(modes: dict) -> list[tuple[str, str]]:
    """Share of the time that each region spent in its states, the largest first."""
    rows: list[tuple[str, str]] = []
    unchanged = {}
    for region, uses in modes.items():
        entered = ((state, use["share"]) for state, use in uses.items() if use["entries"])
        used = sorted(entered, key=lambda item: -item[1])
        if region != MAIN and len(used) == 1:
            unchanged[region] = uses
            continue
        label = (
            message("Time by mode")
            if region == MAIN
            else message("Time by mode of {region}", region=region)
        )
        rows.append((label, ", ".join(f"{state} {share:.1%}" for state, share in used)))
    line = unchanged_in_words(unchanged)
    return [*rows, *([(message("Unchanged throughout"), line)] if unchanged else [])]


def unchanged_in_words(modes: dict) -> str:
    """The only state of each region that was in one state throughout."""
    states = {
        region: [s for s, use in uses.items() if use["entries"]] for region, uses in modes.items()
    }
    return ", ".join(f"{region}: {' '.join(entered)}" for region, entered in states.items())


def time_or_never(t_s: float | None) -> Message:
    """A time [s] in words."""
    return message("never") if t_s is None else _show(t_s, "", "s")


def _show(value, key: str, unit: str) -> Message:
    if value is None:
        return _WHY_NONE.get(key) or message("not reached in this run")
    if unit == "%":
        return message("{value:.4g} %", value=100.0 * value)
    whole = isinstance(value, int) or (unit == "s" and value >= 1000.0)
    number = f"{value:.0f}" if whole else f"{value:.4g}"
    shown = message("{number} {unit}", number=number, unit=unit) if unit else message(number)
    if unit == "s" and value >= 600.0:
        return message("{time} ({clock})", time=shown, clock=clock_text(value))
    return shown
