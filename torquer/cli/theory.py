"""`torquer theory`: averaged motion of a satellite on an orbit under a law."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

Three = tuple[float, float, float]


def theory(
    law: str | None = None,
    /,
    *,
    inclination_deg: Annotated[
        float | None, Parameter(help="Inclination of the circular orbit.")
    ] = None,
    altitude_km: Annotated[float | None, Parameter(help="Altitude of the circular orbit.")] = None,
    strength_nt: Annotated[
        float | None, Parameter(help="Averaged field B0 [nT] [that of the altitude].")
    ] = None,
    inertia: Annotated[
        Three | None, Parameter(help="Principal moments [kg m^2], spin axis last.")
    ] = None,
    gain: Annotated[float | None, Parameter(help="Gain of the law, in its own unit.")] = None,
    rate_deg_s: Annotated[
        Three | None, Parameter(help="Initial rate in body axes [5 5 5].")
    ] = None,
    rho_deg: Annotated[
        float | None,
        Parameter(help="Initial angle of the momentum from the field's cone axis [any]."),
    ] = None,
    sun_deg: Annotated[
        float | None,
        Parameter(help="Angle of the Sun from the field's cone axis, for sdot."),
    ] = None,
    sample_s: Annotated[
        float | None,
        Parameter(help="Sampling and hold interval, for bdot and nutation_damping."),
    ] = None,
    lag_s: Annotated[
        float | None, Parameter(help="Time constant of the coils, with --sample-s [0].")
    ] = None,
    scenario: Annotated[
        Path | None, Parameter(help="Scenario file that gives all of these, and the law.")
    ] = None,
    design: Annotated[
        bool, Parameter(help="Print a table of gains and times instead.", negative="")
    ] = False,
    to: Annotated[
        float | None, Parameter(help="Target fraction of the initial value [%] [10; spin_up 200].")
    ] = None,
    revolutions: Annotated[
        float | None,
        Parameter(help="Time span of the plots; with --design the time allowed."),
    ] = None,
    latex: Annotated[bool, Parameter(help="Equations in LaTeX, by sympy.", negative="")] = False,
    out: Annotated[Path | None, Parameter(help="Folder for evolution.png and map.png.")] = None,
    json: Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")] = False,
) -> int:
    """Averaged motion under LAW: small parameter, times, limit motions, equations, pictures.

    LAW: bdot, nutation_damping, spin_up, reorientation, preliminary_1, preliminary_2 or sdot.
    """
    from torquer.cli import theory_options as options, theory_work as work

    given = {
        "inclination_deg": inclination_deg, "altitude_km": altitude_km,
        "strength_nt": strength_nt, "inertia": inertia, "gain": gain, "rate_deg_s": rate_deg_s,
        "rho_deg": rho_deg, "sun_deg": sun_deg, "sample_s": sample_s, "lag_s": lag_s,
    }  # fmt: skip
    case = options.case_of(law, given, scenario, design)
    part = options.part_of(case, to)
    if design:
        if out is not None or latex:
            other = "--out" if out is not None else "--latex"
            raise ValueError(f"{other}: must not be given with --design; received both")
        return work.design(case, part, revolutions, json)
    return work.show(case, part, revolutions, latex, out, json)
