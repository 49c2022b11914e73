"""What a data sheet lacks: inertia, surfaces and residual dipole from size, mass and class.

Each with how far it may be off. The numbers, and their sources, are those of `size_classes.toml`.
Panels are folded on the faces across x, hinged at the edge to the face of +y, and unfold along +-x
in the plane of that face, each further one of a side outwards.
"""

import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from torquer.base import validate
from torquer.spacecraft.masses import AnyMass, BoxMass, PlateMass, mass_properties
from torquer.spacecraft.parts import AnyPart, Box, Plate

FILE = Path(__file__).with_name("size_classes.toml")


class SizeClass(NamedTuple):
    """Typical values of a class of satellites: `size_m` along x, y, z; `centre_m`: how far the
    centre of mass lies from the middle at most; the others as in scenarios."""

    title: str
    size_m: tuple[float, float, float]
    mass_kg: float
    centre_m: tuple[float, float, float]
    limit_a_m2: float
    tip_off_deg_s: float
    noise_nt: float
    altitude_km: float
    inclination_deg: float
    wheel_momentum_n_m_s: float
    wheel_torque_n_m: float
    gyro_noise_deg_s: float
    attitude_noise_deg: float
    source: str


class Spread(NamedTuple):
    """A value that is not known: the least and the greatest that must be expected, and between."""

    low: float
    typical: float
    high: float


@cache
def sheet_rules() -> dict:
    """What holds for all classes: tables inertia, dipole, surface, panel, each with its source."""
    data = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return {name: table for name, table in data.items() if name != "class"}


@cache
def size_classes() -> dict[str, SizeClass]:
    """The classes by name, from the smallest."""
    tables = tomllib.loads(FILE.read_text(encoding="utf-8"))["class"]
    return {name: _size_class(keys) for name, keys in tables.items()}


def _size_class(keys: dict[str, Any]) -> SizeClass:
    values: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in keys.items()}
    return SizeClass(**values)


def masses_of_box(size_m, mass_kg: float, panels: int = 0) -> tuple[AnyMass, ...]:
    """A box of uniform density, and panels, with `mass_kg` in all; places from the box's middle.

    ValueError for panels as heavy as the satellite, and for sizes that are not positive.
    """
    size, plates = _size(size_m), []
    each_kg = sheet_rules()["panel"]["mass_per_area"] * size[1] * size[2]
    box_kg = mass_kg - panels * each_kg
    if not box_kg > 0.0:
        raise ValueError(
            f"mass_kg: must be above {panels * each_kg:.3g} kg, the mass of {panels} panels; "
            f"received {mass_kg:g}"
        )
    for centre in _panel_centres(size, panels):
        plates.append(
            PlateMass(
                mass_kg=each_kg, size_m=(size[1], size[2]), axis=(0, 1, 0), edge=(1, 0, 0),
                centre_m=centre,
            )
        )  # fmt: skip
    return (BoxMass(mass_kg=box_kg, size_m=size), *plates)


def exposed_parts(size_m, mass_kg: float, panels: int = 0) -> tuple[AnyPart, ...]:
    """What meets air and light: the box and its panels, their centres from the centre of mass."""
    size, surface = _size(size_m), sheet_rules()["surface"]
    keys = {key: value for key, value in surface.items() if key not in ("f107", "source")}
    middle = -mass_properties(masses_of_box(size, mass_kg, panels)).centre_m
    places = [tuple(middle + np.array(centre)) for centre in _panel_centres(size, panels)]
    area_m2 = size[1] * size[2]
    plates = (Plate(axis=(0, 1, 0), area_m2=area_m2, centre_m=place, **keys) for place in places)
    return (Box(size_m=size, centre_m=tuple(middle), **keys), *plates)


def equal_box_m(inertia, mass_kg: float) -> tuple[float, float, float]:
    """Edges [m] of the uniform box with this inertia (3, 3) [kg m^2] in its principal axes.

    Boxes with other edges have other inertias, and each of them is one that a body can have: no
    moment exceeds the sum of the others. ValueError for an inertia with products, or of no body.
    """
    tensor = validate.inertia_tensor("inertia", np.asarray(inertia, dtype=np.float64))
    moments = np.diag(tensor)
    if np.abs(tensor - np.diag(moments)).max() > 1e-9 * moments.max():
        raise ValueError(f"inertia: must have no products of inertia; received {tensor.tolist()}")
    squares = 12.0 / mass_kg * (0.5 * moments.sum() - moments)
    return tuple(np.sqrt(squares).tolist())


def residual_dipole_a_m2(mass_kg: float, measured_a_m2: float | None = None) -> Spread:
    """Size of the residual dipole: by mass, after NASA SP-8018, or one that was measured."""
    rules = sheet_rules()["dipole"]
    if measured_a_m2 is not None:
        low, high = rules["measured"]
        return Spread(low * measured_a_m2, measured_a_m2, high * measured_a_m2)
    return Spread(*(mass_kg * each for each in rules["per_kg"]))


def centre_covariance(deviations_m: Sequence[float], parts: int) -> list[list[float]]:
    """Covariance [m^2] of the centres of parts that a shift of the centre of mass moves alike."""
    square = np.diag(np.square(np.asarray(deviations_m, dtype=np.float64)))
    return np.tile(square, (parts, parts)).tolist()


def _size(size_m) -> tuple[float, float, float]:
    size = validate.finite("size_m", size_m, (3,))
    if not np.all(size > 0.0):
        raise ValueError(f"size_m: must be three positive numbers; received {list(size_m)}")
    return tuple(size.tolist())


def _panel_centres(size, panels: int) -> list[tuple[float, float, float]]:
    """Centres of the panels from the box's middle, in pairs from the box outwards."""
    if panels < 0 or panels % 2:
        raise ValueError(f"panels: must be an even number, 0 or more; received {panels}")
    places = []
    for k in range(panels // 2):
        x = 0.5 * size[0] + (k + 0.5) * size[1]
        places += [(x, 0.5 * size[1], 0.0), (-x, 0.5 * size[1], 0.0)]
    return places
