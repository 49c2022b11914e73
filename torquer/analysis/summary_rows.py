"""The summary as rows of a table: label, value, unit."""

from torquer.analysis.verdict import clock_text
from torquer.computer.modes.spec import MAIN

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


def summary_rows(summary: dict, verdict: bool = True) -> list[tuple[str, str]]:
    """Label and value with unit for every row that applies to the satellite.

    The verdict and its limits come first, unless they are shown elsewhere.
    """
    first = _verdict_rows(summary) if verdict else []
    rows = [(label, _show(summary[key], key, unit)) for label, key, unit in _ROWS if key in summary]
    return [*first, *rows, *_mode_rows(summary.get("modes", {}))]


def _verdict_rows(summary: dict) -> list[tuple[str, str]]:
    """Whether the run met its goals: the verdict, and every limit."""
    verdict = summary["verdict"]
    rows = [("Verdict", verdict["headline"])]
    for goal in verdict["goals"]:
        signal = goal["signal"][0].upper() + goal["signal"][1:]
        label = f"{signal} below {goal['below']:.4g} {goal['unit']}"
        rows += [
            (f"{label}: first at", time_or_never(goal["first_s"])),
            ("  stays below from", time_or_never(goal["stays_from_s"])),
        ]
    return rows


def _mode_rows(modes: dict) -> list[tuple[str, str]]:
    """Share of the time that each region spent in its states, the largest first."""
    rows, unchanged = [], {}
    for region, uses in modes.items():
        entered = ((state, use["share"]) for state, use in uses.items() if use["entries"])
        used = sorted(entered, key=lambda item: -item[1])
        if region != MAIN and len(used) == 1:
            unchanged[region] = uses
            continue
        label = "Time by mode" if region == MAIN else f"Time by mode of {region}"
        rows.append((label, ", ".join(f"{state} {share:.1%}" for state, share in used)))
    line = unchanged_in_words(unchanged)
    return [*rows, *([("Unchanged throughout", line)] if unchanged else [])]


def unchanged_in_words(modes: dict) -> str:
    """The only state of each region that was in one state throughout."""
    states = {
        region: [s for s, use in uses.items() if use["entries"]] for region, uses in modes.items()
    }
    return ", ".join(f"{region}: {' '.join(entered)}" for region, entered in states.items())


def time_or_never(t_s: float | None) -> str:
    """A time [s] in words."""
    return "never" if t_s is None else _show(t_s, "", "s")


def _show(value, key: str, unit: str) -> str:
    if value is None:
        return (
            "needs spacecraft.coils.power_at_limit_w"
            if key == "coil_energy_j"
            else "not reached in this run"
        )
    if unit == "%":
        return f"{100.0 * value:.4g} %"
    whole = isinstance(value, int) or (unit == "s" and value >= 1000.0)
    shown = f"{value:.0f} {unit}" if whole else f"{value:.4g} {unit}"
    longer = f" ({clock_text(value)})" if unit == "s" and value >= 600.0 else ""
    return shown.rstrip() + longer
