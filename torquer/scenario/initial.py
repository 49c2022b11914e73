"""The motion at the start of a run."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, model_validator

from torquer.base.columns import array_of, radians, root
from torquer.base.spec import Spec, Vector
from torquer.maths.geometry import euler
from torquer.maths.geometry.frames import dcm_orbital_to_inertial
from torquer.maths.geometry.quaternion import from_dcm, multiply, normalise, rotate_inverse
from torquer.maths.geometry.vec3 import as_matrix, as_vector


class InitialMotion(Spec):
    """Attitude and rate at the start."""

    euler_deg: Vector = (0.0, 0.0, 0.0)
    """Attitude of the body relative to the `reference`, as Euler angles."""
    sequence: Annotated[str, AfterValidator(euler.known_sequence)] = "321"
    """Axes of the Euler angles in order: any of the 12 intrinsic sequences."""
    quaternion: tuple[float, float, float, float] | None = None
    """Attitude of the body relative to the `reference`, (x, y, z, w), in place of Euler angles."""
    reference: Literal["inertial", "orbital"] = "inertial"
    """Frame to which the attitude is relative."""
    rate_deg_s: Vector
    """Angular velocity in body axes."""
    rate_relative_to: Literal["inertial", "orbital"] = "inertial"
    """Frame to which the angular velocity is relative."""

    @model_validator(mode="after")
    def _attitude_makes_sense(self):
        q = self.quaternion
        if q is not None and abs(root(sum(each * each for each in q)) - 1.0) > 1e-6:
            raise ValueError(
                f"quaternion: must have length 1 within 1e-6; received {list(self.quaternion)}"
            )
        if self.quaternion is not None and any(self.euler_deg):
            raise ValueError(
                "quaternion: either it or euler_deg must be given; received both, euler_deg = "
                f"{list(self.euler_deg)}"
            )
        return self

    @property
    def attitude(self):
        """Quaternion (body to `reference`), however the attitude is given."""
        if self.quaternion is not None:
            return normalise(tuple(self.quaternion))
        return euler.to_quaternion(self.sequence, np.radians(self.euler_deg))

    def motion(self, r_m, v_m_s) -> np.ndarray:
        """Quaternion (body to inertial) and absolute rate [rad/s]: 7 numbers."""
        q = self.attitude
        if self.reference == "orbital":
            q = multiply(from_dcm(as_matrix(dcm_orbital_to_inertial(r_m, v_m_s))), q)
        omega = tuple(map(radians, self.rate_deg_s))
        if self.rate_relative_to == "orbital":
            turning = np.cross(r_m, v_m_s) / np.dot(r_m, r_m)
            turning = rotate_inverse(tuple(q), as_vector(turning))
            omega = tuple(one + other for one, other in zip(omega, turning, strict=True))
        return array_of([*q, *omega])
