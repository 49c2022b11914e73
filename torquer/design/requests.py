"""What the functions of `torquer.design` are asked; the options of `torquer design` are the same.

These classes stand apart from the functions, so that the help of a command loads no compiler.
"""

from typing import Annotated, Literal, NamedTuple

from torquer.base.limits import (
    Range,
    RequestError,
    Three,
    at_least,
    positive,
    request,
    within,
)
from torquer.design.coil_core import PERMALLOY, SLENDER, SLENDEREST, Core


class Key(NamedTuple):
    """Where a key that describes the satellite stands in a scenario."""

    place: str

    @property
    def in_words(self) -> str:
        """Where its range is stated."""
        return f"As {self.place} of scenarios."

    def __repr__(self) -> str:
        return repr(self.in_words)


@request
class DetumbleRequest:
    """What `detumble` is asked.

    DetumbleRequest(tip_off_deg_s=10.0, within_s=20_000.0)
    """

    tip_off_deg_s: Annotated[float | None, positive()] = None
    """Rate after release [the scenario's initial rate]."""
    rate_below_deg_s: Annotated[float | None, positive()] = None
    """Rate that counts as stopped [that of its mission, else three orbital rates, or more where
    these lie within the motion that remains]."""
    within_s: Annotated[float | None, positive()] = None
    """Time by which all releases must have stopped [that of its mission, else none]."""
    gains: Annotated[int, within(3, 99)] = 9
    """Gains flown, from a tenth to ten times that of the theory."""
    runs: Annotated[int, within(1, 100_000)] = 32
    """Releases with each gain at each of the times."""
    times: Annotated[int, within(1, 1000)] = 8
    """Times of release, spread over a day."""


@request
class PointingRequest:
    """What `pointing_budget` is asked.

    PointingRequest(flights=200, window_s=10.0, dynamic_imbalance_g_mm2=500.0)
    """

    flights: Annotated[int, within(0, 10_000)] = 16
    """Flights with each cause, and with all; 0: the prediction alone."""
    window_s: Annotated[float, positive()] = 60.0
    """Window of stability (RPE), rounded to whole control cycles, two or more."""
    confidence: Annotated[float, within(0.5, 0.9999)] = 0.95
    """Part of instants and flights that do not exceed the angle that is stated with it."""
    dynamic_imbalance_g_mm2: Annotated[float | None, positive()] = None
    """Dynamic imbalance of each wheel [none]."""
    static_imbalance_g_mm: Annotated[float | None, positive()] = None
    """Static imbalance of each wheel [none]."""
    wheel_distance_mm: Annotated[float | None, positive()] = None
    """Distance of the wheels from the centre of mass, for the static imbalance [0]."""


@request
class SheetRequest:
    """What `from_sheet` is asked: a size class, and what a data sheet says in place of its values.

    SheetRequest(like="3u", mass_kg=3.4, panels=2)
    """

    like: str | None = None
    """Write a scenario of a satellite of this size: 1u, 2u, 3u, 6u, 12u, 50kg, 150kg."""
    mass_kg: Annotated[float | None, positive("mass_kg")] = None
    """Mass [that of the class]."""
    size_m: Annotated[Three | None, Key("spacecraft.body.box_m")] = None
    """Edges along x, y, z, the longest along z [those of the class]."""
    panels: Annotated[int, within(0, 8)] = 0
    """Deployable panels, an even number; each as large as a face across x."""
    limit_a_m2: Annotated[float | None, positive("limit_a_m2")] = None
    """Greatest dipole of each of three coils [that of the class]."""
    dipole_a_m2: Annotated[float | None, positive("limit_a_m2")] = None
    """Size of the residual dipole, measured [by mass, after NASA SP-8018]."""
    altitude_km: Annotated[float | None, positive("altitude_km")] = None
    """Altitude of the circular orbit [that of the class]."""
    inclination_deg: Annotated[float | None, within(0.0, 180.0)] = None
    """Its inclination [that of the class]."""
    wheels: bool = False
    """With four reaction wheels, gyro and attitude sensor: a slew to the nadir, unloading."""


@request
class ThreeAxisRequest:
    """What `three_axis` is asked.

        ThreeAxisRequest(inertia=(0.03, 0.03, 0.01), altitude_km=550.0, inclination_deg=97.6,
                         limit_a_m2=0.2)

    Nothing of the satellite where a scenario is given.
    """

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
    linear_range_deg: Annotated[
        float, Range("lie within 0..90 deg, ends left out", lambda angle: 0.0 < angle < 90.0)
    ] = 10.0
    """Attitude error up to which the coils must not saturate."""
    gain_margin: Annotated[float, within(1.0, 100.0)] = 2.0
    """Factor on the dipole with which the loop must stay stable."""
    revolutions: Annotated[int | None, at_least(1)] = None
    """Revolutions after which the field repeats [about a day]."""
    capture_runs: Annotated[int | None, within(1, 1_000_000)] = None
    """Random initial attitudes to fly with each law [none]."""
    capture_rate_deg_s: Annotated[float, within(0.0, 360.0)] = 1.0
    """Greatest initial rate flown."""
    capture_within_deg: Annotated[float, within(0.0, 180.0)] = 30.0
    """Attitude error within which a run must stay to count as captured, and above which a steady
    error makes a law unusable."""


@request
class MagnetoGyroRequest:
    """What `magneto_gyro` is asked.

    MagnetoGyroRequest(tip_off_deg_s=5.0, fly=0)
    """

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


@request
class CoilRequest:
    """What `coil` is asked.

    CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4)
    """

    dipole_a_m2: Annotated[float, positive()]
    """Dipole that the coil must have."""
    diameter_m: Annotated[float, positive()]
    """Diameter of its turns."""
    mass_kg: Annotated[float, positive()]
    """Mass of its wire, without insulation."""
    metal: Literal["copper", "aluminium"] = "copper"
    """Metal of the wire in the table of gauges."""
    temperature_c: Annotated[float, within(-100.0, 200.0, "deg C")] = 20.0
    """Temperature of the wire."""
    voltage_v: Annotated[float | None, positive()] = None
    """Greatest voltage; thinner wire needs more [no limit]."""
    current_a: Annotated[float | None, positive()] = None
    """Greatest current; thicker wire needs more [no limit]."""
    core_length_m: Annotated[float | None, within(1e-4, 100.0)] = None
    """Length of a rod in the coil, which is wound over all of it [no core]."""
    core_diameter_m: Annotated[float | None, positive()] = None
    """Diameter of the rod [no core]."""
    core_permeability: Annotated[float | None, at_least(1.0)] = None
    """Relative permeability of the rod [20 000, of permalloy]."""
    core_saturation_t: Annotated[float | None, within(1e-3, 10.0)] = None
    """Saturation of the rod [0.75, of permalloy]."""

    def __post_init__(self):
        sizes = ("core_length_m", "core_diameter_m")
        given = [key for key in (*sizes, "core_permeability", "core_saturation_t")
                 if getattr(self, key) is not None]  # fmt: skip
        for key in sizes:
            if given and getattr(self, key) is None:
                raise RequestError(key, f"must be given with {given[0]}", given[0])
        if not given:
            return
        length, rod = self.core_length_m, self.core_diameter_m
        if not SLENDER * rod <= length <= SLENDEREST * rod:
            must = f"must be {SLENDER:g} to {SLENDEREST:g} times core_diameter_m, a long rod"
            raise RequestError("core_length_m", f"{must}; received {length:g}", "core_diameter_m")
        if rod >= self.diameter_m:
            must = f"must be less than diameter_m, that of the turns, {self.diameter_m:g}"
            raise RequestError("core_diameter_m", f"{must}; received {rod:g}", "diameter_m")

    def core(self) -> Core | None:
        """The rod in the coil, if there is one."""
        if self.core_length_m is None or self.core_diameter_m is None:
            return None
        metal = self.core_permeability or PERMALLOY[0], self.core_saturation_t or PERMALLOY[1]
        return Core(self.core_length_m, self.core_diameter_m, *metal)


@request
class BenchRequest:
    """What `bench` is asked.

        BenchRequest(time_s=600.0, bench_inertia=0.4, inertia=1.6, bench_field_nt=1e5,
                     field_nt=1e4)

    Ratios are of orbit to bench.
    """

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


@request
class MissionRequest:
    """What `mission` is asked: MissionRequest(tip_off_deg_s=10.0, runs=16)."""

    tip_off_deg_s: Annotated[float | None, positive()] = None
    """Rate after release [the scenario's initial rate]."""
    pointing_deg: Annotated[float | None, within(0.0, 180.0)] = None
    """Error within which it must stay; with slews from what is commanded [mission, else 30]."""
    runs: Annotated[int, within(1, 10_000)] = 16
    """Releases of each gain at each of two times of a day, and starts of each hold."""
    workers: Annotated[int | None, at_least(1)] = None
    """Flights with faults at once [one per core]."""

    def within_deg(self, scenario) -> float:
        """Error [deg] within which a scenario must stay."""
        own = scenario.mission and (
            scenario.mission.attitude_error_below_deg or scenario.mission.commanded_error_below_deg
        )
        return self.pointing_deg or own or 30.0


@request
class WheelsRequest:
    """What `wheels` is asked besides the design: WheelsRequest(sweep="alpha_deg=40:88")."""

    sweep: str | None = None
    """Sweep an angle of the layout: gamma_deg=20:85, or =20:85:14 for 14 points."""
