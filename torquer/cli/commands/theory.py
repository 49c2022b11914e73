"""`torquer theory`: averaged motion of a satellite under a law; models of the gyroscopic system."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App

from torquer.base.limits import Three, positive, within
from torquer.cli.examples import examples_of
from torquer.cli.options import CodeOptions, Json, options

app = App(name="theory", help_epilogue=examples_of("theory"), version_flags=[])

_HALF_TURN = within(0.0, 180.0, "deg")


@options
class CaseOptions:
    """Options that describe law, satellite and orbit: not with --scenario."""

    inclination_deg: Annotated[float | None, _HALF_TURN] = None
    """Inclination of the circular orbit."""
    altitude_km: Annotated[float | None, positive()] = None
    """Altitude of the circular orbit."""
    strength_nt: Annotated[float | None, positive("strength_nt")] = None
    """Averaged field B0 [nT] [that of the altitude]."""
    inertia: Three | None = None
    """Principal moments [kg m^2], spin axis last."""
    gain: Annotated[float | None, positive("gain_a_m2_per_t")] = None
    """Gain of the law, in its own unit."""
    rate_deg_s: Three | None = None
    """Initial rate in body axes [5 5 5]."""
    rho_deg: Annotated[float | None, _HALF_TURN] = None
    """Initial angle of the momentum from the field's cone axis [any]."""
    sun_deg: Annotated[float | None, _HALF_TURN] = None
    """Angle of the Sun from the field's cone axis, for sdot."""
    sample_s: Annotated[float | None, positive()] = None
    """Sampling and hold interval, for bdot and nutation_damping."""
    lag_s: float | None = None
    """Time constant of the coils, with --sample-s [0]."""


@options
class TheoryOptions(CaseOptions):
    """Options of `torquer theory`."""

    scenario: Path | None = None
    """Scenario file that gives all of these, and the law."""
    design: bool = False
    """Print a table of gains and times instead."""
    to: float | None = None
    """Target fraction of the initial value [%] [10; spin_up 200]."""
    revolutions: Annotated[float | None, positive("revolutions")] = None
    """Time span of the plots; with --design the time allowed."""
    latex: bool = False
    """Equations in LaTeX, by sympy."""
    out: Path | None = None
    """Folder for evolution.png and map.png."""
    json: Json = False


@app.default
def theory(law: str | None = None, /, *, how: TheoryOptions = TheoryOptions()) -> int:
    """Averaged motion under LAW: small parameter, times, limit motions, equations, pictures.

    LAW: bdot, nutation_damping, spin_up, reorientation, preliminary_1, preliminary_2 or sdot.
    """
    from torquer.cli.commands import theory_work as work

    return (work.design if how.design else work.show)(law, how)


@options
class GyroModelOptions:
    """Options of `torquer theory magneto-gyro`."""

    order: Literal[12, 15] | None = None
    """Model of stage 1 (12) or of stage 2 (15) alone."""
    out: Path | None = None
    """Folder for pictures of stability, roots, errors and the answer to a dipole, with SCENARIO."""
    json: Json = False


@app.command(name="magneto-gyro", help_epilogue=examples_of("theory magneto-gyro"))
def magneto_gyro(
    scenario: Path | None = None,
    /,
    *,
    how: GyroModelOptions = GyroModelOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Models of the magneto-gyroscopic system with constant coefficients, text against law.

    The rows of the text next to those that sympy derives from the law, with what must be corrected;
    characteristic polynomials; why a constant dipole leaves no error. With SCENARIO, whose law is
    magneto_gyro: its numbers, and the exact model in the field of a dipole.
    """
    from torquer.cli.commands import theory_gyro_work as work

    return work.show(scenario, how, code)
