"""`torquer design`: gains of control laws, from the satellite and its orbit."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from torquer.base.limits import Three, positive, within
from torquer.cli.options import CodeOptions, Json, options


class Key(NamedTuple):
    """Where an option that describes the satellite stands in a scenario."""

    place: str


@options
class DesignOptions:
    """Options of `torquer design three-axis`."""

    inertia: Annotated[Three | None, Key("spacecraft.body.inertia_kg_m2")] = None
    """Principal moments [kg m^2]."""
    altitude_km: Annotated[float | None, Key("orbit.altitude_km")] = None
    """Altitude of the circular orbit."""
    inclination_deg: Annotated[float | None, Key("orbit.inclination_deg")] = None
    """Its inclination."""
    limit_a_m2: Annotated[float | None, Key("spacecraft.coils.limit_a_m2")] = None
    """Greatest dipole of each of three coils."""
    sample_s: Annotated[float | None, Key("control.sample_s")] = None
    """Sampling and hold interval [1]."""
    measure_s: Annotated[float | None, Key("control.measure_s")] = None
    """Window with the coils off, a multiple of --sample-s [0]."""
    actuate_s: Annotated[float | None, Key("control.actuate_s")] = None
    """Window with the coils on, with --measure-s."""
    field: Annotated[
        Literal["igrf14", "wmm2025", "tilted_dipole", "direct_dipole", "averaged"] | None,
        Key("environment.field.kind"),
    ] = None
    """Field model [igrf14]."""
    reference: Annotated[Literal["orbital", "inertial"] | None, Key("control.law.reference")] = None
    """Frame of the attitude to be held [orbital]."""
    euler_deg: Annotated[Three | None, Key("control.law.euler_deg")] = None
    """That attitude, as 3-2-1 Euler angles [0 0 0]."""
    residual_a_m2: Annotated[Three | None, Key("spacecraft.coils.residual_dipole_a_m2")] = None
    """Residual dipole [0 0 0]."""
    torque_n_m: Annotated[Three | None, Key("disturbance.constant_torque_n_m")] = None
    """Constant disturbance torque [0 0 0]."""
    attitude_noise_deg: Annotated[float | None, Key("spacecraft.attitude_sensor.noise_deg")] = None
    """Noise of the attitude about each axis [0]."""
    rate_noise_deg_s: Annotated[float | None, Key("spacecraft.gyro.noise_deg_s")] = None
    """Noise of the rate about each axis [0]."""
    linear_range_deg: float = 10.0
    """Attitude error up to which the coils must not saturate."""
    gain_margin: float = 2.0
    """Factor on the dipole with which the loop must stay stable."""
    revolutions: int | None = None
    """Revolutions after which the field repeats [about a day]."""
    capture_runs: Annotated[int | None, within(1, 1_000_000)] = None
    """Random initial attitudes to fly with each law [none]."""
    capture_rate_deg_s: Annotated[float, within(0.0, 360.0)] = 1.0
    """Greatest initial rate flown."""
    capture_within_deg: Annotated[float, within(0.0, 180.0)] = 30.0
    """Attitude error within which a run must stay to count as captured, and above which a steady
    error makes a law unusable."""
    out: Path | None = None
    """Folder for map.png and the laws as TOML."""
    json: Json = False


def three_axis(
    scenario: Path | None = None,
    /,
    *,
    how: DesignOptions = DesignOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains for three-axis control by coils alone: by formula, refined, and a periodic regulator.

    SCENARIO describes the satellite, if given; otherwise the options do. A law of SCENARIO that
    holds an attitude is assessed, too. A run counts as captured if its error stays within
    --capture-within-deg over the last revolution, whatever the law.
    """
    from torquer.cli.commands import design_work as work

    return work.show(scenario, how, code)


@options
class GyroOptions:
    """Options of `torquer design magneto-gyro`."""

    form: Literal["field", "text"] = "field"
    """What stage 2 turns with: the field model on board, or the Earth's dipole (the text)."""
    tip_off_deg_s: Annotated[float | None, within(0.01, 30.0)] = None
    """Greatest rate after separation [3, or the scenario's initial rate if that is greater]."""
    filter_rate_rad_s: Annotated[float | None, within(1e-3, 3.0)] = None
    """Frequency of the filters of stage 1 [from the tip-off rate]."""
    degree: Annotated[float, within(0.01, 1.0)] = 0.25
    """Wanted Floquet degree of stage 2, per 1/nu0."""
    evaluations: Annotated[int, within(10, 10_000)] = 120
    """Most loops tried by each of the two searches for weights."""
    fly: Annotated[int | None, within(0, 1000)] = None
    """Releases to fly until they point; 0: none [12, fewer if they take long]."""
    out: Path | None = None
    """Folder for law, scenario and pictures."""
    json: Json = False


def magneto_gyro(
    scenario: Path,
    /,
    *,
    how: GyroOptions = GyroOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Gains of the magneto-gyroscopic system: magnetometer, coils and a pitch wheel.

    SCENARIO describes the satellite: inertia, wheel_momentum_n_m_s of its body, orbit, field, model
    on board, noise and bias of the magnetometer. Its own laws and modes are replaced in
    scenario.toml, which flies from the tip-off rate until the satellite points.
    """
    from torquer.cli.commands import design_gyro_work as work

    return work.show(scenario, how, code)


@options
class DetumbleOptions:
    """Options of `torquer design detumble`."""

    tip_off_deg_s: Annotated[float | None, positive()] = None
    """Rate after release [the scenario's initial rate]."""
    rate_below_deg_s: Annotated[float | None, positive()] = None
    """Rate that counts as stopped [that of its mission, else three orbital rates]."""
    within_s: Annotated[float | None, positive()] = None
    """Time by which all releases must have stopped [that of its mission, else none]."""
    gains: Annotated[int, within(3, 99)] = 9
    """Gains flown, from a tenth to ten times that of the theory."""
    runs: Annotated[int, within(1, 100_000)] = 32
    """Releases with each gain at each of the times."""
    times: Annotated[int, within(1, 1000)] = 8
    """Times of release, spread over a day."""
    out: Path | None = None
    """Folder for gains.png and the scenario with the gain."""
    json: Json = False


def detumble(
    scenario: Path,
    /,
    *,
    how: DetumbleOptions = DetumbleOptions(),
    code: CodeOptions = CodeOptions(),
) -> int:
    """Which gain for B-dot? From theory with saturation, sampling and lag, then flown.

    SCENARIO describes the satellite and its control cycle. The same releases are flown with each
    gain. With --within-s the least gain is chosen with which most stop in time; without it the
    least with which most stop, nine in ten of them at most 10 % later than with any other.
    """
    from torquer.cli.commands import design_detumble_work as work

    return work.show(scenario, how, code)


@options
class CoilOptions:
    """Options of `torquer design coil`."""

    dipole_a_m2: Annotated[float, positive()]
    """Dipole that the coil must have."""
    diameter_m: Annotated[float, positive()]
    """Diameter of its turns."""
    mass_kg: Annotated[float, positive()]
    """Mass of its wire, without insulation."""
    metal: Literal["copper", "aluminium"] = "copper"
    """Metal of the wire in the table of gauges."""
    temperature_c: Annotated[float, within(-100.0, 200.0)] = 20.0
    """Temperature of the wire."""
    voltage_v: Annotated[float | None, positive()] = None
    """Greatest voltage; thinner wire needs more [no limit]."""
    current_a: Annotated[float | None, positive()] = None
    """Greatest current; thicker wire needs more [no limit]."""
    json: Json = False


def coil(*, how: CoilOptions) -> int:
    """A magnetorquer without a core: power of copper and aluminium, and its wire by gauge.

    The power follows from dipole, diameter and mass alone; the gauge divides it between voltage and
    current. Round turns of bare wire are assumed; the wound section is 60 % metal.
    """
    from torquer.cli.commands import design_coil_work as work

    return work.show(how)


@options
class BenchOptions:
    """Options of `torquer design bench`: ratios of orbit to bench."""

    time_s: Annotated[float, positive()]
    """Time that the bench took to stop the rotation."""
    bench_inertia: Annotated[float, positive()]
    """Moment of inertia on the bench [kg m^2]."""
    inertia: Annotated[float, positive()]
    """That of the satellite [kg m^2]."""
    bench_field_nt: Annotated[float, positive()]
    """Field of the bench."""
    field_nt: Annotated[float, positive()]
    """Field in orbit."""
    dipole_ratio: Annotated[float, positive()] = 1.0
    """Dipole limit of the satellite over that on the bench."""
    gain_ratio: Annotated[float, positive()] = 1.0
    """Gain of B-dot of the satellite over that on the bench."""
    json: Json = False


def bench(*, how: BenchOptions) -> int:
    """From a B-dot test on a bench to the time in orbit, for the same initial rate.

    Coils at their limits: the time goes with inertia over field. Below the limits: with inertia
    over the square of the field. A test usually begins with the first and ends with the second.
    """
    from torquer.cli.commands import design_coil_work as work

    return work.show_bench(how)
