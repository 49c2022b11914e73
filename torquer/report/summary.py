"""The numbers of a run that matter first."""

import json

import numpy as np
import xarray as xr

from torquer.simulation.result import scenario_of


def summary_of(result: xr.Dataset) -> dict:
    """Summary as plain data: value by key, unit in the key."""
    scenario = scenario_of(result)
    omega0 = scenario.orbit.rate_rad_s(scenario.start)
    t = result["time"].values
    rate = np.linalg.norm(result["omega_body"].values, axis=1)
    momentum = np.linalg.norm(result["momentum_inertial"].values, axis=1)
    coils = scenario.spacecraft.coils
    power_w = coils.power_at_limit_w if coils else None
    energy_j = float(result["coil_energy"])
    return {
        "scenario": scenario.name,
        "ended": result.attrs["ended"],
        "simulated_s": float(t[-1]),
        "revolutions": float(t[-1] * omega0 / (2.0 * np.pi)),
        "orbital_rate_deg_s": float(np.degrees(omega0)),
        "initial_rate_deg_s": float(np.degrees(rate[0])),
        "final_rate_deg_s": float(np.degrees(rate[-1])),
        "final_rate_orbital_rates": float(rate[-1] / omega0),
        **_times_below(t, rate, omega0),
        "peak_coil_dipole_a_m2": float(result["peak_coil_dipole"]),
        "coil_energy_j": energy_j if power_w else None,
        "coil_full_power_s": energy_j / (power_w or 1.0),
        "initial_momentum_n_m_s": float(momentum[0]),
        "momentum_left_n_m_s": float(momentum[-1]),
        "table_relative_error": float(result.attrs["table_relative_error"]),
        "law": result.attrs["law"],
        "law_runs_as": result.attrs["law_runs_as"],
        "seed": int(result.attrs["seed"]),
        "versions": json.loads(result.attrs["versions"]),
    }


def _times_below(t, rate, omega0) -> dict:
    """First time below 2 and 3 orbital rates, and the time from which it stays below."""
    times = {}
    for factor in (3, 2):
        below = rate < factor * omega0
        first = float(t[np.argmax(below)]) if below.any() else None
        stays = None
        if below[-1]:
            above = np.flatnonzero(~below)
            stays = float(t[above[-1] + 1]) if above.size else float(t[0])
        times[f"time_to_below_{factor}x_orbital_rate_s"] = first
        times[f"stays_below_{factor}x_orbital_rate_from_s"] = stays
    return times


_ROWS = (
    ("Simulated", "simulated_s", "s"),
    ("Revolutions", "revolutions", ""),
    ("Orbital rate", "orbital_rate_deg_s", "deg/s"),
    ("Initial rate", "initial_rate_deg_s", "deg/s"),
    ("Final rate", "final_rate_deg_s", "deg/s"),
    ("Final rate", "final_rate_orbital_rates", "orbital rates"),
    ("Below 3 orbital rates first at", "time_to_below_3x_orbital_rate_s", "s"),
    ("  and stays there from", "stays_below_3x_orbital_rate_from_s", "s"),
    ("Below 2 orbital rates first at", "time_to_below_2x_orbital_rate_s", "s"),
    ("  and stays there from", "stays_below_2x_orbital_rate_from_s", "s"),
    ("Peak dipole of a coil", "peak_coil_dipole_a_m2", "A m²"),
    ("Coil energy", "coil_energy_j", "J"),
    ("  the same as full power for", "coil_full_power_s", "coil-seconds"),
    ("Momentum at first", "initial_momentum_n_m_s", "N m s"),
    ("Momentum left", "momentum_left_n_m_s", "N m s"),
    ("Table's relative error, at most", "table_relative_error", ""),
)


def rows_of(summary: dict) -> list[tuple[str, str]]:
    """Label and value with unit, for tables."""
    rows = []
    for label, key, unit in _ROWS:
        value = summary[key]
        if value is None:
            shown = "coil power not given" if key == "coil_energy_j" else "not within this run"
        else:
            digits = f"{value:.0f}" if unit == "s" and value >= 1000.0 else f"{value:.4g}"
            shown = f"{digits} {unit}".rstrip()
            if unit == "s" and value >= 600.0:
                shown += f" ({value / 60.0:.1f} min)"
        rows.append((label, shown))
    return rows
