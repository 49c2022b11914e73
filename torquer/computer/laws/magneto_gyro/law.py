"""Law of the magneto-gyroscopic system: its keys in a scenario."""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Inertia, Vector
from torquer.computer.informed import MODEL_FIELD, PLACE
from torquer.computer.laws.magneto_gyro.kernel import (
    MEMORY,
    Dipole,
    MagnetoGyroParameters,
    Stage1,
    Switch,
    magneto_gyro,
)
from torquer.computer.laws.magneto_gyro.relay import COILS
from torquer.computer.laws.magneto_gyro.stage_2 import Gyrostat, Stage2Gains
from torquer.computer.laws.pointing import HeldAttitude
from torquer.maths.geometry.quaternion import to_dcm


class MagnetoGyro(HeldAttitude):
    """Orbital attitude by a magnetometer, coils and a pitch wheel, without gyro and Earth sensor.

    Gains are in units of the satellite: angles in rad, time in 1/nu0, torque in J nu0^2. Here nu0
    is the orbital rate, J the root of the product of the moments of inertia about roll and yaw.
    """

    kind: Literal["magneto_gyro"] = "magneto_gyro"
    kernel: ClassVar = magneto_gyro
    memory: ClassVar = MEMORY
    log: ClassVar = {
        "stage": "1",
        "angles_rad": "rad",
        "rates_rad_s": "rad/s",
        "residual_dipole_a_m2": "A m^2",
        "mean_angle_rad": "rad",
        "mean_rate_rad_s": "rad/s",
    }
    #: Field as read and as calculated, orbital frame, the coils' dipole; neither attitude nor rate.
    needs: ClassVar = PLACE | MODEL_FIELD | {"magnetometer", "coil_dipole"}
    states: ClassVar = "estimate"
    reference: Literal["orbital"] = "orbital"
    """Reference frame of the wanted attitude."""
    inertia_kg_m2: Inertia
    """Inertia of the body with its wheel, as the law knows it: three moments or 3x3."""
    bias_momentum_n_m_s: float
    """Momentum of the wheel along the orbit normal in the wanted attitude, as the law knows it."""
    orbital_rate_rad_s: float = Field(gt=0.0)
    """Mean orbital rate nu0, as the law knows it."""
    capture_angle_gain: float = Field(gt=0.0)
    """Angle gain K/(J nu0^2) of stage 1."""
    capture_rate_gain: float = Field(gt=0.0)
    """Rate gain N/(J nu0) of stage 1."""
    filter_rate_rad_s: float = Field(gt=0.0)
    """Natural frequency of the filters by which stage 1 differentiates the field: a satellite that
    turns faster than about 0.8 of it is not braked.
    """
    filter_damping: float = Field(default=0.7, gt=0.0, lt=1.0)
    """Damping ratio of these filters."""
    coils: Literal["linear", "each_coil", "nearest_angle"] = "linear"
    """How stage 1 drives the coils: 'linear'; each coil on where its component exceeds a threshold;
    or, where the vector exceeds it, the combination of coils nearest in angle.
    """
    relay_threshold_a_m2: Annotated[float, Field(ge=0.0)] | None = None
    """Threshold of relay coils; left out with linear ones."""
    relay_dipole_a_m2: Annotated[float, Field(gt=0.0)] | None = None
    """Dipole of a relay coil that is on; left out with linear ones."""
    form: Literal["field", "text"] = "field"
    """What stage 2 turns with: 'field', the field model on board; 'text', the Earth's dipole."""
    dipole_nt: Vector | None = None
    """Gauss coefficients g10, g11, h11 of the dipole, for the form 'text' alone."""
    meridian_deg: float | None = None
    """Angle of the prime meridian from the first inertial axis at the start (sidereal time), for
    the form 'text' alone.
    """
    angle_gains: Vector
    """Gains d1, d2, d3 of stage 2: D_i/(J nu0^2)."""
    rate_gains: Vector
    """Gains n1, n2, n3 of stage 2: N_i/(J nu0)."""
    estimator_gains: tuple[float, float, float, float, float, float]
    """Gains k1 to k6 of the estimator: K_i/nu0 of angles (odd), K_i/(J nu0^2) of rates (even)."""
    compensator_gains: Vector
    """Gains e1, e2, e3 with which the satellite's own dipole is learned: E_i/(J nu0^3)."""
    coil_duty: float = Field(default=1.0, gt=0.0, le=1.0)
    """Part of the time in which the coils are on, where the field is read with them off: stage 2
    asks for as much more, so that the mean dipole is the wanted one.
    """
    stage_2_angle_deg: float = Field(default=15.0, gt=0.0, lt=90.0)
    """Mean angle between the fields, as read and by the model, below which stage 2 may begin."""
    stage_2_rate_deg_s: float = Field(default=0.18, gt=0.0)
    """Mean rate across the field below which it may begin."""
    stage_1_angle_deg: float = Field(default=35.0, gt=0.0, lt=180.0)
    """Mean angle between the fields above which stage 1 takes over again."""
    mean_time_s: float = Field(default=1500.0, gt=0.0)
    """Time constant of these means; a stage 1 lasts twice as long at least."""

    @model_validator(mode="after")
    def _switches_with_hysteresis(self):
        if not self.stage_1_angle_deg > self.stage_2_angle_deg:
            raise ValueError(
                "stage_1_angle_deg: must be above stage_2_angle_deg, or the stages would chatter; "
                f"received {self.stage_1_angle_deg:g} and {self.stage_2_angle_deg:g}"
            )
        return self

    @model_validator(mode="after")
    def _keys_that_go_together(self):
        relay = ("relay_threshold_a_m2", "relay_dipole_a_m2")
        self._given_only_if(self.coils != "linear", relay, f"coils = {self.coils!r}")
        self._given_only_if(
            self.form == "text", ("dipole_nt", "meridian_deg"), f"form = {self.form!r}"
        )
        return self

    def _given_only_if(self, wanted: bool, keys: tuple[str, ...], why: str):
        for key in keys:
            if (getattr(self, key) is not None) != wanted:
                must = "be given" if wanted else "be left out"
                raise ValueError(f"{key}: must {must} with {why}; received {getattr(self, key)}")

    @property
    def gains(self) -> Stage2Gains:
        """The 15 gains of stage 2."""
        return Stage2Gains(
            *self.angle_gains, *self.rate_gains, *self.estimator_gains, *self.compensator_gains
        )

    def parameters(self) -> MagnetoGyroParameters:
        """Satellite, gains of both stages, switch, dipole."""
        turn = np.array(to_dcm(self.q_wanted()))
        about_t, about_w, about_s = np.diag(turn @ np.array(self.inertia_kg_m2) @ turn.T).tolist()
        j, rate = math.sqrt(about_t * about_s), self.orbital_rate_rad_s
        pitch_inertia = about_w / j
        stiffness = self.bias_momentum_n_m_s / (j * rate) + pitch_inertia - 2.0
        return MagnetoGyroParameters(
            inertia=j,
            orbital_rate=rate,
            craft=Gyrostat(stiffness, pitch_inertia),
            q_wanted=self.q_wanted(),
            stage_1=self._stage_1(j * rate),
            gains=self.gains,
            coil_duty=self.coil_duty,
            switch=Switch(
                *np.radians(
                    [self.stage_2_angle_deg, self.stage_2_rate_deg_s, self.stage_1_angle_deg]
                ).tolist(),
                self.mean_time_s,
            ),
            dipole=self._dipole(),
        )

    def _stage_1(self, momentum: float) -> Stage1:
        return Stage1(
            self.capture_angle_gain * momentum * self.orbital_rate_rad_s,
            self.capture_rate_gain * momentum,
            self.filter_rate_rad_s,
            self.filter_damping,
            COILS[self.coils],
            self.relay_threshold_a_m2 or 0.0,
            self.relay_dipole_a_m2 or 0.0,
        )

    def _dipole(self) -> Dipole:
        if self.form == "field":
            return Dipole(0.0, (0.0, 0.0, 0.0), 0.0)
        g10, g11, h11 = (1e-9 * g for g in self.dipole_nt)
        return Dipole(1.0, (g11, h11, g10), math.radians(self.meridian_deg))
