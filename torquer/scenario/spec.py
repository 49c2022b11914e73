"""What a run needs, as specs in edge units; `Scenario` is the whole of it."""

import math
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from torquer.base.columns import stacked, unstacked
from torquer.base.language import message
from torquer.base.shared import shared
from torquer.base.spec import Spec
from torquer.base.time import parse_utc, utc_text
from torquer.base.user_source import attributes_read
from torquer.base.validate import storable_name
from torquer.computer.blocks.block import Block
from torquer.computer.blocks.law import Law
from torquer.computer.estimation.filter import MAGNETOMETER_ERRORS, Filter
from torquer.computer.modes.packing import check_choice
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.ephemeris import AnyEnvironment, ModelErrors, model_errors
from torquer.environment.orbit import AnyOrbit
from torquer.maths.geometry.frames import argument_of_latitude
from torquer.scenario.change import with_values
from torquer.scenario.control import MOST_STEPS, Control, Positive, common_divisor, whole_steps
from torquer.scenario.ending import EndWhen
from torquer.scenario.initial import InitialMotion
from torquer.scenario.mission import Mission
from torquer.scenario.resolution import check_step, speeds_at_start
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.aerodynamics import Aerodynamics
from torquer.spacecraft.body import Body
from torquer.spacecraft.disturbance import TORQUES, Disturbance
from torquer.spacecraft.disturbance.held import NO_HELD_TORQUE, HeldTorque
from torquer.spacecraft.disturbance.magnets import MagnetKeys, Magnets
from torquer.spacecraft.disturbance.unmodelled import NONE_UNMODELLED, Unmodelled
from torquer.spacecraft.failures import Interval
from torquer.spacecraft.sensors.devices import Sensors
from torquer.spacecraft.sensors.sampling import Sampled

#: A run that starts in the last year may go on into the next.
_LATEST_END = datetime(2101, 1, 1, tzinfo=UTC)
#: Default of the error that adaptive steps may add to the attitude in a revolution.
_TOLERANCE_DEG = 1e-4
#: Control steps and readings until the timetable repeats: all of them are in memory.
_MOST_INSTANTS = 100_000
#: Instants of a run at which the models on board are compared with the truth.
_INSTANTS_OF_MODELS = 2000
#: Interval of the memory of hysteresis rods with adaptive steps.
_HYSTERESIS_STEP_S = 1.0


class Platform(Spec):
    """Body and actuators of a satellite."""

    body: Body
    """Inertia and mass."""
    coils: Coils | None = None
    """Magnetorquers; left out: none."""
    wheels: ReactionWheels | None = None
    """Reaction wheels; left out: none."""


class Spacecraft(Sensors, MagnetKeys, Platform):
    """Body, coils, wheels and sensors; sensors that are left out are ideal."""

    aerodynamics: Aerodynamics | None = None
    """Parts of the body on which the air acts; left out: no aerodynamic torque."""

    @model_validator(mode="after")
    def _rotors_fit(self):
        if self.wheels is None:
            return self
        # a rotor that its bearing holds follows the body's rate a step late: no real wheel is so
        # heavy that this matters, and one that is would drive the body
        body, rotors = stacked(self.body.inertia), self.wheels.rotor_tensor_kg_m2()
        shares = np.linalg.eigvals(np.linalg.solve(body, rotors)).real.max(axis=-1)
        share = unstacked(shares, 0)
        if share >= 0.5:
            raise ValueError(
                "wheels: their rotors' inertia (momentum_limit_n_m_s at speed_limit_rpm) must be "
                f"below half of the body's about any axis; received {share:.3g} of it"
            )
        return self

    @model_validator(mode="after")
    def _couplings_fit(self):
        count = len(self.coils.axes) if self.coils else 0
        for name, each in self.flown().items():
            coupling = getattr(each.spec, "coil_coupling_nt_per_a_m2", None)
            if coupling is not None and len(coupling) != count:
                raise ValueError(
                    f"{name}.coil_coupling_nt_per_a_m2: must have a vector for each of the coils "
                    f"({count}); received {len(coupling)}"
                )
        return self

    def sensors_that_may_fail(self) -> dict[str, Sampled]:
        """The sensors that are described, by their keys: ideal stand-ins do not fail.

        Of a satellite with coils the magnetometer may fail in any case.
        """
        described = self.model_fields_set | ({"magnetometer"} if self.coils else set())
        sensors = self.sensors()
        return {key: sensors[key] for key in sensors if key.partition(".")[0] in described}

    def devices(self) -> dict[str, Any]:
        """The devices with a data sheet, by their keys."""
        found = {"coils": self.coils, "wheels": self.wheels} | self.sensors()
        return {key: device for key, device in found.items() if hasattr(device, "sheet")}

    def of_kind(self, name: str) -> dict[str, Any]:
        """The devices with a data sheet that are of a kind on board, by their keys."""
        return {key: each for key, each in self.devices().items() if self.kind_of(key) == name}

    def kind_of(self, key: str) -> str:
        """What a device is on board, by its key."""
        flown = self.flown()
        return flown[key].device.kind if key in flown else key

    def sensors(self) -> dict[str, Sampled]:
        """The sensors by their keys, such as `gyro` or, of several, `gyros.NAME`."""
        return {key: each.spec for key, each in self.flown().items()}


class Simulation(Spec):
    """How the run is computed.

    All events at given times fall on multiples of `step_s` or, if it is left out, of the greatest
    common divisor of these times. A long run is computed in pieces and its result written piece by
    piece; `torquer validate` reports its rows, memory, disk space and computing time, and refuses a
    run that cannot fit.
    """

    duration_s: Positive | None = None
    """Duration, rounded up to whole record intervals. Either it or `revolutions` is given."""
    revolutions: Positive | None = None
    """Duration in orbital periods. Either it or `duration_s` is given."""
    step_s: Positive | None = None
    """Fixed step; left out: adaptive steps."""
    record_s: Positive = 10.0
    """Interval between records, not longer than the run."""
    record_inputs: bool = False
    """Record also what else the on-board computer knows: times of the readings, tachometers, dipole
    of the coils, its own ephemeris. `torquer smooth` needs it, and a record at every control step.
    """
    integrator: Literal["auto", "rk4", "splitting"] = "auto"
    """'auto' (adaptive steps of order 8; the result states the estimated error), 'rk4' (fixed
    steps, the default with `step_s`) or 'splitting' (fixed steps, exact free rotation between
    kicks: large steps for a fast spinner).
    """
    tolerance_deg: float = Field(default=_TOLERANCE_DEG, ge=1e-10, le=10.0)
    """Attitude error that adaptive steps may add in each orbital revolution."""
    max_step_s: float | None = Field(default=None, ge=1e-3)
    """Longest adaptive step; left out: no limit."""
    end_when: EndWhen | None = None
    """Condition that ends the run before its time; left out: none."""

    @model_validator(mode="before")
    @classmethod
    def _fixed_steps_are_of_rk4(cls, data):
        if isinstance(data, Mapping) and data.get("step_s") is not None:
            return {"integrator": "rk4", **data}
        return data

    @model_validator(mode="after")
    def _steps_are_of_one_kind(self):
        if self.integrator == "auto" and self.step_s is not None:
            raise ValueError(
                "step_s: must be left out with integrator 'auto', whose accuracy is tolerance_deg; "
                f"received {self.step_s:g} s"
            )
        if self.integrator != "auto" and self.step_s is None:
            raise ValueError(
                f"step_s: must be given with integrator {self.integrator!r}; received none"
            )
        if self.integrator != "auto" and self.tolerance_deg != _TOLERANCE_DEG:
            raise ValueError(
                "tolerance_deg: must be left out except with integrator 'auto'; received "
                f"{self.tolerance_deg:g} with {self.integrator!r}"
            )
        if self.integrator != "auto" and self.max_step_s is not None:
            raise ValueError(
                "max_step_s: must be left out except with integrator 'auto'; received "
                f"{self.max_step_s:g} s with {self.integrator!r}"
            )
        return self

    @property
    def in_words(self) -> str:
        """The integrator and its steps or its tolerance."""
        if self.step_s is not None:
            return message(
                "{integrator}, steps of {step:g} s", integrator=self.integrator, step=self.step_s
            )
        return message(
            "steps with errors below {tolerance:g} deg a revolution", tolerance=self.tolerance_deg
        )

    def error_rates(self, period_s: float) -> tuple[float, float]:
        """Error that steps may add to the attitude [rad] and to the rate [rad/s] in a second.

        An error of the rate at the start of a revolution turns the attitude by its end.
        """
        attitude = math.radians(self.tolerance_deg) / period_s
        return attitude, attitude / period_s

    @model_validator(mode="after")
    def _one_duration(self):
        if (self.duration_s is None) == (self.revolutions is None):
            received = "none" if self.duration_s is None else "both"
            raise ValueError(
                f"duration_s: either it or revolutions must be given; received {received}"
            )
        return self


def _checked_start(value) -> datetime:
    """UTC of the start; within the years for which Sun's path and leap seconds are valid."""
    try:
        start = parse_utc(value, "start")
    except OverflowError:  # a zone beyond the first or the last day of the calendar
        start = None
    if start is None or not 1900 <= start.year < 2100:
        raise ValueError(f"start: must lie within the years 1900 to 2099; received {str(value)!r}")
    return start


class Scenario(Spec):
    """A whole run.

    >>> scenario.orbit.altitude_km
    550.0
    >>> higher = scenario.replace("orbit.altitude_km", 600)
    >>> higher.orbit.altitude_km
    600.0
    """

    name: str = Field(default="run", pattern=r"^\w[\w.-]*$")
    """Name of the run; left out: the name of the file."""
    description: str = ""
    """What the run is for, in a sentence."""
    start: Annotated[
        datetime,
        BeforeValidator(_checked_start),
        PlainSerializer(utc_text, return_type=str, when_used="json"),
    ]
    """UTC of the start with its zone, such as "2024-03-20T12:00:00Z"."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Seed of all random numbers."""
    orbit: AnyOrbit
    """The orbit."""
    environment: Environment = Environment()
    """Models of the field, the Earth, the Sun and the atmosphere."""
    spacecraft: Spacecraft
    """Body, actuators and sensors."""
    disturbance: Disturbance | None = None
    """Disturbance torques in addition to gravity gradient and aerodynamics; left out: none."""
    initial: InitialMotion
    """Attitude and rate at the start."""
    control: Control
    """The on-board computer."""
    simulation: Simulation
    """Duration, steps and record."""
    mission: Mission | None = None
    """Goals of the run, for the verdict in its report; left out: usual limits."""

    @model_validator(mode="after")
    def _steps_fit(self):
        control, simulation = self.control, self.simulation
        step_s = self.grid_s
        whole_steps("control.sample_s", control.sample_s, step_s)
        whole_steps("control: measure_s + actuate_s", control.cycle_s, step_s)
        whole_steps("simulation.record_s", simulation.record_s, step_s)
        self._check_step()
        if self.environment.table_tolerance == 0.0 and simulation.integrator != "rk4":
            raise ValueError(
                "environment.table_tolerance: 0 (no table) needs simulation.integrator 'rk4'; "
                f"received {simulation.integrator!r}"
            )
        self._check_sampling()
        self._check_actuators()
        self._check_switching()
        if self.spacecraft.aerodynamics and self.environment.atmosphere is None:
            raise ValueError(
                "environment.atmosphere: must be given with spacecraft.aerodynamics; received none"
            )
        self._check_end()
        self._check_ephemeris()
        self._check_mission()
        self._check_failures()
        self._check_modes()
        self._check_selections()
        self._check_filters()
        self._check_disturbance()
        return self

    @shared
    def _check_step(self) -> None:
        """Fixed steps can follow the motion at the start."""
        if self.simulation.integrator == "rk4":
            check_step(speeds_at_start(self.spacecraft, self.initial), self.grid_s)

    @shared
    def _check_sampling(self) -> None:
        """Readings fall on steps, and their timing repeats after a number of steps."""
        control, step_s = self.control, self.grid_s
        cycle = whole_steps("cycle", control.cycle_s, step_s)
        intervals = {"control.sample_s": cycle}
        for name, sensor in self.spacecraft.sensors().items():
            interval, _ = sampling_steps(f"spacecraft.{name}", sensor, step_s)
            intervals |= {f"spacecraft.{name}.sample_s": interval} if interval else {}
        whole = math.lcm(*intervals.values())
        windows = (control.steps_in_cycle - 1) * (whole // cycle)
        if sum(whole // each for each in intervals.values()) + windows > _MOST_INSTANTS:
            raise ValueError(
                f"{[*intervals][-1]}: must let control steps and readings repeat after at most "
                f"{_MOST_INSTANTS} of them; received a common multiple of {whole * step_s:g} s"
            )

    @shared
    def _check_disturbance(self) -> None:
        """Torques have what they need: parts, whole steps, an integrator that supports them."""
        self._check_bench()
        self.magnets()
        given = self.disturbance
        if given is None:
            return
        self.held_torque()
        light = given.solar_pressure
        if light and not (light.parts or self.spacecraft.aerodynamics):
            raise ValueError(
                "disturbance.solar_pressure.parts: must be given without spacecraft.aerodynamics, "
                "whose parts they would be; received none"
            )
        self._check_sink()
        self.unmodelled_torque()
        for name in given.own:
            storable_name("disturbance.own", name)
        turning = [key for key in TORQUES if TORQUES[key].depends_on_rate and getattr(given, key)]
        turning += [f"own.{name}" for name in given.own]
        if turning:
            self._check_not_splitting(f"disturbance.{turning[0]}")

    def _check_sink(self) -> None:
        """The energy sink is a part of the body, whose momentum is its own."""
        sink, craft = self.disturbance and self.disturbance.energy_sink, self.spacecraft
        if not sink:
            return
        if craft.wheels is not None:
            raise ValueError(
                "disturbance.energy_sink: must be left out with spacecraft.wheels, whose momentum "
                "it does not know; received both"
            )
        rest = np.array(craft.body.inertia) - sink.damper()
        if (least := float(np.linalg.eigvalsh(rest)[0])) <= 0.0:
            raise ValueError(
                "disturbance.energy_sink.damper_kg_m2: must be below the body's inertia, of which "
                f"it is a part, about any axis; received one that leaves {least:.3g} kg m^2"
            )

    def _check_bench(self) -> None:
        """What belongs to a test bench is given for a bench, and complete."""
        is_bench = self.orbit.kind == "bench"
        if self.environment.field.kind == "helmholtz_coils" and not is_bench:
            raise ValueError(
                "environment.field.kind: must be another than 'helmholtz_coils' unless orbit.kind "
                f"is 'bench'; received it with {self.orbit.kind!r}"
            )
        if self.disturbance is None or self.disturbance.suspension is None:
            return
        if not is_bench:
            raise ValueError(
                "disturbance.suspension: must be left out unless orbit.kind is 'bench'; received "
                f"it with {self.orbit.kind!r}"
            )
        if self.spacecraft.body.total_mass_kg() is None:
            raise ValueError(
                "spacecraft.body.mass_kg: must be given with disturbance.suspension, for the "
                "weight; received none"
            )
        if not self.environment.gravity_gradient:
            raise ValueError(
                "environment.gravity_gradient: must be true with disturbance.suspension, whose "
                "vertical is that of the gravity; received false"
            )
        self._check_not_splitting("disturbance.suspension")

    @shared
    def _check_end(self) -> None:
        """Models of the surroundings are valid for the years in which a run may start."""
        if self.length_s > (_LATEST_END - self.start).total_seconds():
            raise ValueError(
                f"simulation: the run must end before {_LATEST_END.year}; received a length of "
                f"{self.length_s / 86400.0:.6g} days from {self.start.isoformat()}"
            )

    @shared
    def _check_ephemeris(self) -> None:
        """Two-line elements are fitted to an orbit that is more than theory."""
        age_days = self.control.ephemeris.tle_age_days
        if age_days is not None and self.orbit.kind != "numerical":
            raise ValueError(
                "control.ephemeris.tle_age_days: must be left out unless orbit.kind is "
                f"'numerical'; received {age_days:g} with {self.orbit.kind!r}"
            )

    @shared
    def _check_mission(self) -> None:
        """Limits can be reached during the run."""
        within_s = self.mission.within_s if self.mission else None
        if within_s is not None and within_s > self.length_s:
            raise ValueError(
                f"mission.within_s: must not exceed the run's length of {self.length_s:g} s; "
                f"received {within_s:g} s"
            )

    @shared
    def _check_failures(self) -> None:
        """Failures happen during the run."""
        length_s, craft = self.length_s, self.spacecraft
        found: dict[str, tuple[Interval, ...]] = {
            f"spacecraft.{name}": sensor.failures for name, sensor in craft.sensors().items()
        }
        found["spacecraft.coils"] = craft.coils.failures if craft.coils else ()
        found["control"] = self.control.failures
        for key, failures in found.items():
            for k, failure in enumerate(failures):
                if failure.from_s >= length_s:
                    raise ValueError(
                        f"{key}.failures[{k}].from_s: must be before the end of the "
                        f"run, {length_s:g} s; received {failure.from_s:g} s"
                    )

    @shared
    def _check_selections(self) -> None:
        """What is selected is there several times."""
        combined = self.spacecraft.combined()
        for name, how in self.control.select.items():
            if name not in combined:
                raise ValueError(
                    f"control.select.{name}: must be a kind of sensor of which laws read one for "
                    f"several ({', '.join(combined) or 'none'}); received {name!r}"
                )
            if how.kind == "vote" and len(combined[name]) < 3:
                raise ValueError(
                    f"control.select.{name}.kind: must be 'mean' or 'spare' with fewer than three "
                    f"sensors, of which none is outvoted; received 'vote' of {len(combined[name])}"
                )
        modes = self.control.modes
        for place, state in modes.all_states() if modes else ():
            key = f"control.modes.{place}.select"
            for kind, unit in state.select.items():
                check_choice(key, combined, kind)
                check_choice(f"{key}.{kind}", combined[kind], unit)

    @shared
    def _check_filters(self) -> None:
        """What filters assume of single sensors is of those that they measure with."""
        units, control = self.spacecraft.units(), self.control
        several = any(each.device.name == "magnetometer" for each in units)
        named = {f"estimators.{name}": each for name, each in control.estimators.items()}
        for key, spec in {"estimator": control.estimator, **named}.items():
            if not isinstance(spec, Filter):
                continue
            known = spec.measured_names(units)
            for name in spec.unit_noise:
                check_choice(f"control.{key}.unit_noise", known, name)
            for error in MAGNETOMETER_ERRORS if several else ():
                if (value := getattr(spec, error)) is not None:
                    raise ValueError(
                        f"control.{key}.{error}: must be left out with "
                        "spacecraft.magnetometers, each of which has errors of its own; received "
                        f"{value:g}"
                    )

    @shared
    def _check_modes(self) -> None:
        """The check of the coils knows of a momentum that is in no reading."""
        modes, momentum = self.control.modes, self.spacecraft.body.wheel_momentum_n_m_s
        sensors = self.spacecraft.rows()
        for key, condition in modes.all_conditions() if modes else ():
            if condition.sensor is not None:
                check_choice(f"control.modes.{key}.sensor", sensors, condition.sensor)
        if modes and modes.noise and modes.wheel_momentum_n_m_s is None and any(momentum):
            raise ValueError(
                "control.modes.wheel_momentum_n_m_s: must be given for checks of the coils "
                "(control.modes.noise) of a body with spacecraft.body.wheel_momentum_n_m_s; "
                "received none"
            )

    @shared
    def _check_actuators(self) -> None:
        """Laws need the actuators they drive; wheels need an integrator that supports them."""
        program = self.control.named()
        specs, laws = program.laws, program.known_laws()
        for name, law in laws.items():
            if specs[name].kind != "off":
                check_fits(self.control.key_of(name), law, self)
        if len(laws) == len(specs):
            check_stated(laws.values(), self.control)
        if self.spacecraft.wheels is not None:
            self._check_not_splitting("spacecraft.wheels")

    @shared
    def _check_switching(self) -> None:
        """Coils are switched faster than they are commanded, in an environment between steps."""
        coils, control = self.spacecraft.coils, self.control
        if coils is None or coils.pwm_period_s is None:
            return
        held_s = control.actuate_s or control.sample_s
        if coils.pwm_period_s > held_s * (1.0 + 1e-9):
            raise ValueError(
                f"spacecraft.coils.pwm_period_s: must not exceed the {held_s:g} s for which a "
                f"command is held; received {coils.pwm_period_s:g} s"
            )
        if self.environment.table_tolerance == 0.0:
            raise ValueError(
                "environment.table_tolerance: must be above 0 with spacecraft.coils.pwm_period_s, "
                "whose switchings fall between the steps; received 0"
            )

    def _check_not_splitting(self, key: str) -> None:
        """What stands at the key acts by the rate: only other integrators support it."""
        if self.simulation.integrator == "splitting":
            raise ValueError(
                f"simulation.integrator: must be 'auto' or 'rk4' with {key}; received 'splitting'"
            )

    @shared
    def held_torque(self) -> HeldTorque:
        """Constant and random torque for kernels."""
        if self.disturbance is None:
            return NO_HELD_TORQUE
        hold_s = self.disturbance.random_hold_s or self.control.sample_s
        hold_steps = whole_steps("disturbance.random_hold_s", hold_s, self.grid_s)
        return self.disturbance.pack_held(hold_steps)

    @shared
    def acting_torques(self) -> tuple:
        """Constants of the torques of `torquer.spacecraft.disturbance`, () for none."""
        air, given, packed = self.spacecraft.aerodynamics, self.disturbance or Disturbance(), None
        if given.suspension is not None:
            packed = given.suspension.pack(
                self.spacecraft.body.total_mass_kg(), *self._angle_and_rate()
            )
        return given.pack(air.parts if air else (), packed, self.magnets(), self.spacecraft.body)

    def magnets(self) -> Magnets | tuple[()]:
        """Permanent magnets and hysteresis rods for kernels, () for none."""
        craft, step_s = self.spacecraft, self.grid_s
        wanted_s = self._hysteresis_step_s() or step_s
        steps = whole_steps("spacecraft.hysteresis_step_s", wanted_s, step_s)
        return craft.pack_magnets(steps)

    def _hysteresis_step_s(self) -> float | None:
        """Interval of the rods' memory; None without rods, and for that of fixed steps."""
        craft = self.spacecraft
        if not craft.hysteresis_rods or craft.hysteresis_step_s is not None:
            return craft.hysteresis_step_s
        return _HYSTERESIS_STEP_S if self.simulation.step_s is None else None

    @shared
    def unmodelled_torque(self) -> Unmodelled | tuple[()]:
        """Sizes and jumps of the unmodelled torque; () where none of `acting_torques` acts."""
        if not self.acting_torques():
            return ()
        torque = None if self.disturbance is None else self.disturbance.unmodelled
        if torque is None:
            return NONE_UNMODELLED
        key = "disturbance.unmodelled.hold_s"
        return torque.pack_sizes(whole_steps(key, torque.hold_s, self.grid_s))

    @shared
    def orbit_angle(self) -> tuple[float, ...]:
        """Argument of latitude at the start [rad], mean orbital rate [rad/s]; () if not needed."""
        return self._angle_and_rate() if self.acting_torques() else ()

    def motion_at_start(self) -> np.ndarray:
        """Attitude (body to inertial) and absolute rate [rad/s] at the start: 7 numbers."""
        r, v = self.orbit_environment().state(np.zeros(1))
        return self.initial.motion(r[0], v[0])

    def _angle_and_rate(self) -> tuple[float, float]:
        r, v = self.orbit_environment().state(np.zeros(1))
        return argument_of_latitude(r[0], v[0]), self.orbit.rate_rad_s(self.start)

    def replace(self, key: str, value) -> "Scenario":
        """The scenario with another value at a key, such as "control.laws.bdot.gain_a_m2_s_per_t".

        Checked as a scenario file is; `ScenarioError` names the key, what must hold and what was
        received. An element of a list has its number in brackets: "spacecraft.parts[0].area_m2".
        """
        return with_values(self, {key: value})

    def _repr_html_(self) -> str:
        """In notebooks: what was given, as the text of a scenario file."""
        from torquer.scenario.toml_text import html_of_given

        return html_of_given(self)

    @shared
    def orbit_environment(self) -> OrbitEnvironment:
        """The environment along this orbit."""
        return OrbitEnvironment(self.environment, self.orbit, self.start)

    @shared
    def believed_environment(self) -> AnyEnvironment:
        """The environment as the on-board computer's models give it: the true one if it has none.

        `control.ephemeris` states how they differ.
        """
        return self.control.ephemeris.along(self.orbit_environment())

    def model_errors(self) -> ModelErrors | None:
        """Errors of the computer's models along the run, at some thousand instants.

        None where they are the truth.
        """
        t_s = np.linspace(0.0, self.length_s, _INSTANTS_OF_MODELS)
        return model_errors(self.orbit_environment(), self.believed_environment(), t_s)

    @property
    @shared
    def grid_s(self) -> float:
        """Interval of the time grid [s] on which all events fall: the step of fixed steps.

        Without fixed steps the greatest common divisor of all given times.
        """
        if self.simulation.step_s is not None:
            return self.simulation.step_s
        return common_divisor(self._times())

    def _times(self) -> dict[str, float]:
        """Times [s] that events keep to, by key."""
        control, craft = self.control, self.spacecraft
        times: dict[str, float | None] = {
            "control.sample_s": control.sample_s,
            "control.measure_s": control.measure_s,
            "control.actuate_s": control.actuate_s,
            "simulation.record_s": self.simulation.record_s,
            "spacecraft.hysteresis_step_s": self._hysteresis_step_s(),
        }
        if self.disturbance is not None:
            times["disturbance.random_hold_s"] = self.disturbance.random_hold_s
            if self.disturbance.unmodelled is not None:
                times["disturbance.unmodelled.hold_s"] = self.disturbance.unmodelled.hold_s
        for name, sensor in craft.sensors().items():
            times[f"spacecraft.{name}.sample_s"] = sensor.sample_s
            times[f"spacecraft.{name}.delay_s"] = sensor.delay_s
        if craft.wheels is not None:
            for k, failure in enumerate(craft.wheels.failures):
                times[f"spacecraft.wheels.failures[{k}].time_s"] = failure.time_s
        return {key: time_s for key, time_s in times.items() if time_s}

    @property
    def length_s(self) -> float:
        """Length of the run [s]: whole record intervals."""
        return self.steps() * self.grid_s

    @shared
    def steps(self) -> int:
        """Number of integration steps: the duration, rounded up to whole record intervals."""
        s = self.simulation
        per_record = whole_steps("simulation.record_s", s.record_s, self.grid_s)
        try:
            duration = s.duration_s or s.revolutions * self.orbit.period_s
            if duration < s.record_s * (1.0 - 1e-9):
                raise ValueError(
                    f"simulation.record_s: must not exceed the duration of {duration:g} s; "
                    f"received {s.record_s:g} s"
                )
            steps = math.ceil(duration / s.record_s - 1e-9) * per_record
        except ArithmeticError:  # an orbit or a duration beyond the range of floats
            steps = 0
        if not 0 < steps <= MOST_STEPS:
            received = f"{steps:.3g}" if steps else "more than can be counted"
            raise ValueError(
                f"simulation: a run must have 1 to {MOST_STEPS:.0e} steps; received {received}"
            )
        return steps


def sampling_steps(key: str, sensor: Sampled, step_s: float) -> tuple[int, int]:
    """Interval and delay of a sensor's readings in steps; (0, 0): read at every control step."""
    if sensor.sample_s is None:
        return 0, 0
    interval = whole_steps(f"{key}.sample_s", sensor.sample_s, step_s)
    return interval, whole_steps(f"{key}.delay_s", sensor.delay_s, step_s) if sensor.delay_s else 0


def check_stated(laws: Iterable[Law], control: Control) -> None:
    """ValueError where the estimate is to be that which a law states, and no law states one."""
    laws = [*laws]
    for name, spec in {"estimator": control.estimator, **control.estimators}.items():
        if spec.kind == "law" and not any(law.states for law in laws):
            key = name if name == "estimator" else f"estimators.{name}"
            raise ValueError(
                f"control.{key}: must be of another kind than 'law', unless a law states an "
                f"estimate (magneto_gyro); received laws {', '.join(law.name for law in laws)}"
            )


def check_fits(key: str, law: Law, scenario: Scenario) -> None:
    """ValueError unless the satellite has what a law drives and needs; `key`: in `control`."""
    craft, control = scenario.spacecraft, scenario.control
    estimators = (control.estimator, *control.estimators.values())
    wheels = law.drives_wheels or "tachometers" in law.needs
    for part, wanted in (("coils", law.drives_coils), ("wheels", wheels)):
        if wanted and getattr(craft, part) is None:
            raise ValueError(
                f"spacecraft.{part}: must be given for control.{key} ({law.name}); received none"
            )
    for need in ("attitude", "rate"):
        if need in law.needs and not any(need in estimator.gives for estimator in estimators):
            raise ValueError(
                f"control.estimator: must give the {need}, which control.{key} ({law.name}) "
                f"needs; received {control.estimator.kind!r}"
            )
    check_own_reading(f"control.{key}", law, craft)


def check_own_reading(key: str, block: Block, craft: Spacecraft) -> None:
    """ValueError for a law or estimator that reads a sensor of the user's own which is not there.

    One that looks when it was read may know better.
    """
    used = attributes_read(block.function) or frozenset()
    if craft.own_sensor is None and "own_reading" in used and "read_at" not in used:
        raise ValueError(
            f"spacecraft.own_sensor: must be given for {key} ({block.name}), which reads "
            "own_reading; received none"
        )
