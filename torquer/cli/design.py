"""`torquer design`: gains of control laws, from the satellite and its orbit."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

app = App(name="design", help="Gains of control laws, from the satellite and its orbit.",
          version_flags=[])  # fmt: skip

Three = tuple[float, float, float]


@app.command(name="three-axis")
def three_axis(
    scenario: Path | None = None,
    /,
    *,
    inertia: Annotated[Three | None, Parameter(help="Principal moments [kg m^2].")] = None,
    altitude_km: Annotated[float | None, Parameter(help="Altitude of the circular orbit.")] = None,
    inclination_deg: Annotated[float | None, Parameter(help="Its inclination.")] = None,
    limit_a_m2: Annotated[
        float | None, Parameter(help="Greatest dipole of each of three coils.")
    ] = None,
    sample_s: Annotated[float | None, Parameter(help="Sampling and hold interval [1].")] = None,
    measure_s: Annotated[
        float | None, Parameter(help="Window with the coils off, a multiple of --sample-s [0].")
    ] = None,
    actuate_s: Annotated[
        float | None, Parameter(help="Window with the coils on, with --measure-s.")
    ] = None,
    field: Annotated[
        Literal["igrf14", "wmm2025", "tilted_dipole", "direct_dipole", "averaged"] | None,
        Parameter(help="Field model [igrf14]."),
    ] = None,
    reference: Annotated[
        Literal["orbital", "inertial"] | None,
        Parameter(help="Frame of the attitude to be held [orbital]."),
    ] = None,
    euler_deg: Annotated[
        Three | None, Parameter(help="That attitude, as 3-2-1 Euler angles [0 0 0].")
    ] = None,
    residual_a_m2: Annotated[Three | None, Parameter(help="Residual dipole [0 0 0].")] = None,
    torque_n_m: Annotated[
        Three | None, Parameter(help="Constant disturbance torque [0 0 0].")
    ] = None,
    attitude_noise_deg: Annotated[
        float | None, Parameter(help="Noise of the attitude about each axis [0].")
    ] = None,
    rate_noise_deg_s: Annotated[
        float | None, Parameter(help="Noise of the rate about each axis [0].")
    ] = None,
    linear_range_deg: Annotated[
        float, Parameter(help="Attitude error up to which the coils must not saturate.")
    ] = 10.0,
    gain_margin: Annotated[
        float, Parameter(help="Factor on the dipole with which the loop must stay stable.")
    ] = 2.0,
    revolutions: Annotated[
        int | None, Parameter(help="Revolutions after which the field repeats [about a day].")
    ] = None,
    capture_runs: Annotated[
        int | None, Parameter(help="Random initial attitudes to fly with each law [none].")
    ] = None,
    capture_rate_deg_s: Annotated[float, Parameter(help="Greatest initial rate flown.")] = 1.0,
    out: Annotated[Path | None, Parameter(help="Folder for map.png and the laws as TOML.")] = None,
    json: Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")] = False,
) -> int:
    """Gains for three-axis control by coils alone: by formula, refined, and a periodic regulator.

    SCENARIO describes the satellite, if given; otherwise the options do. A law of SCENARIO that
    holds an attitude is assessed, too. A run counts as captured if its error stays, over the last
    revolution, within the sum of the linear range and the predicted steady error.
    """
    from torquer.cli import design_options as options, design_work as work
    from torquer.cli.design_capture import CaptureTask

    given = {
        "inertia": inertia, "altitude_km": altitude_km, "inclination_deg": inclination_deg,
        "limit_a_m2": limit_a_m2, "sample_s": sample_s, "measure_s": measure_s,
        "actuate_s": actuate_s, "field": field, "reference": reference,
        "euler_deg": euler_deg, "residual_a_m2": residual_a_m2, "torque_n_m": torque_n_m,
        "attitude_noise_deg": attitude_noise_deg, "rate_noise_deg_s": rate_noise_deg_s,
    }  # fmt: skip
    case = options.case_of(scenario, given, (linear_range_deg, gain_margin, revolutions))
    starts = None if capture_runs is None else CaptureTask(capture_runs, capture_rate_deg_s)
    return work.show(case, starts, out, json)
