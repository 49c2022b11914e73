"""`torquer theory`: what the averaged motion says of a satellite, an orbit and a law."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

Three = tuple[float, float, float]


def theory(
    law: str | None = None,
    /,
    *,
    inclination_deg: Annotated[float | None, Parameter(help="Of the circular orbit.")] = None,
    altitude_km: Annotated[float | None, Parameter(help="Of the circular orbit.")] = None,
    strength_nt: Annotated[
        float | None, Parameter(help="Averaged field B0 [nT] [that of the altitude].")
    ] = None,
    inertia: Annotated[
        Three | None, Parameter(help="Principal moments [kg m^2], spin axis last.")
    ] = None,
    gain: Annotated[float | None, Parameter(help="Of the law, in its own unit.")] = None,
    rate_deg_s: Annotated[Three | None, Parameter(help="Rate in the body [5 5 5].")] = None,
    rho_deg: Annotated[
        float | None, Parameter(help="Momentum to the field's cone axis at first [any].")
    ] = None,
    sample_s: Annotated[
        float | None,
        Parameter(help="Interval of readings and holds, for bdot and nutation_damping."),
    ] = None,
    lag_s: Annotated[
        float | None, Parameter(help="Time constant of the coils, with --sample-s [0].")
    ] = None,
    scenario: Annotated[
        Path | None, Parameter(help="File to take all of this from, and the law.")
    ] = None,
    design: Annotated[
        bool, Parameter(help="Table of gains and times instead.", negative="")
    ] = False,
    to: Annotated[
        float | None, Parameter(help="Part of the first value to come to [%] [10; spin_up 200].")
    ] = None,
    revolutions: Annotated[
        float | None,
        Parameter(help="Length of pictures; with --design the time to find the gain for."),
    ] = None,
    latex: Annotated[bool, Parameter(help="Equations in LaTeX, by sympy.", negative="")] = False,
    out: Annotated[Path | None, Parameter(help="Folder for evolution.png and map.png.")] = None,
    json: Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")] = False,
) -> int:
    """Averaged motion under LAW: small parameter, times, where it leads, equations, pictures.

    LAW: bdot, nutation_damping, spin_up, reorientation, preliminary_1 or preliminary_2.
    """
    from torquer.cli import theory_options as options
    from torquer.cli import theory_work as work

    given = {
        "inclination_deg": inclination_deg, "altitude_km": altitude_km,
        "strength_nt": strength_nt, "inertia": inertia, "gain": gain, "rate_deg_s": rate_deg_s,
        "rho_deg": rho_deg, "sample_s": sample_s, "lag_s": lag_s,
    }  # fmt: skip
    asked = options.question_of(law, given, scenario, design)
    part = options.part_of(asked, to)
    if design:
        if out is not None or latex:
            other = "--out" if out is not None else "--latex"
            raise ValueError(f"{other}: must not be given with --design; received both")
        return work.design(asked, part, revolutions, json)
    return work.show(asked, part, revolutions, latex, out, json)
