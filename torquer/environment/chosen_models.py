"""Models on board by choice of the ground: which orbit, which field, where the Sun is."""

from typing import NamedTuple

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.ephemeris import EphemerisModels
from torquer.environment.field import AnyField, DirectDipole, Gauss, Igrf14, TiltedDipole
from torquer.environment.orbit import Sgp4
from torquer.environment.orbit.elements_adrift import adrift


class NoSuchModel(ValueError):
    """A choice that this computer does not have."""


class Choice(NamedTuple):
    """What the ground chooses; as it stands here: the models with which the flight began.

    `kepler`: two-line elements that drift, in place of SGP4; `dipole`: the field's first degree
    alone; `degree`: that of the field, 0: the model's own; `sun_inertial`: direction in which the
    Sun stays.
    """

    kepler: bool = False
    dipole: bool = False
    degree: int = 0
    sun_inertial: tuple[float, float, float] | None = None


AS_LAUNCHED = Choice()


def chosen_models(
    launched: EphemerisModels,
    truth: OrbitEnvironment,
    elements: tuple[str, str] | None,
    choice: Choice,
) -> EphemerisModels:
    """Models of the ephemeris by choice, for a computer that began with others.

    `elements`: two lines in place of the orbit; its stated errors are then gone, those of the clock
    stay. `NoSuchModel` for what the computer does not have, ValueError for elements, a degree or a
    direction that cannot be.
    """
    given: dict = {}
    if elements is not None:
        given |= dict.fromkeys(_ORBIT_ERRORS, 0.0) | {"tle_age_days": None}
        given["orbit"] = Sgp4(tle=elements)
    if choice.kepler:
        orbit = given.get("orbit") or launched.orbit_on_board(truth)
        if not isinstance(orbit, Sgp4):
            must = "must be left out without two-line elements on board"
            raise NoSuchModel(f"kepler: {must}; received an orbit of kind {orbit.kind!r}")
        given |= {"tle_age_days": None, "orbit": adrift(orbit, truth.start)}
    if choice.dipole or choice.degree:
        given["field"] = _field(launched.field or truth.environment.field, choice)
    if choice.sun_inertial is not None:
        given["sun_direction"] = choice.sun_inertial
    return launched.model_copy(update=given)


_ORBIT_ERRORS = ("along_track_error_m", "cross_track_error_m", "radial_error_m")


def _field(model: AnyField, choice: Choice) -> AnyField:
    if not isinstance(model, Gauss | TiltedDipole | DirectDipole):
        raise NoSuchModel(f"field: must be left out with a field of kind {model.kind!r} on board")
    if not choice.dipole:
        whole = model if isinstance(model, Gauss) else Igrf14()
        return whole.model_copy(update={"degree": choice.degree})
    if not isinstance(model, Gauss):
        return model
    kept = {"extrapolate": model.extrapolate, "held_at_year": model.held_at_year}
    return TiltedDipole(source=model.kind, **kept)
