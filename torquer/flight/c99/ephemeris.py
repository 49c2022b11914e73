"""The ephemeris on board as C: its constants, its elements at the start, and its kernels."""

from typing import NamedTuple

import numpy as np

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.base.time import decimal_year
from torquer.computer.on_board_environment import ELEMENTS, KINDS, Models, ephemeris_along
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.earth.harmonics import Harmonics
from torquer.environment.field import DirectDipole, Gauss, TiltedDipole, gauss
from torquer.environment.field.coefficients import pieces
from torquer.environment.field.drift import coefficients_name, linear_piece
from torquer.environment.orbit import Bench
from torquer.flight.c99.elements import find_elements
from torquer.flight.c99.program import Program, translate_repeatedly
from torquer.flight.c99.types import INT, REAL, Array, Record, Tuple, Type, find_type
from torquer.scenario.spec import Scenario

#: Field models that a sum of harmonics in Earth-fixed axes can be.
_FIELDS = (Gauss, TiltedDipole, DirectDipole)
#: Instants of the replay: every two minutes of a day.
_EVERY_S, _LAST_S = 120.0, 86400.0


class OnBoardEphemeris(NamedTuple):
    """What is exported: how the place is found, constants, elements at the start (one row)."""

    kind: str
    models: Models
    elements: np.ndarray
    own: OrbitEnvironment


def find_ephemeris(scenario: Scenario, kind: str) -> OnBoardEphemeris:
    """The ephemeris of a scenario's computer: its field model, its orbit without stated errors.

    ValueError of one line where there is none.
    """
    if kind not in KINDS:
        raise ValueError(f"ephemeris: must be one of {', '.join(KINDS)}; received {kind!r}")
    truth, stated = scenario.orbit_environment(), scenario.control.ephemeris
    field = truth.environment.field if stated.field is None else stated.field
    _check(kind, truth, field)
    environment = truth.environment.model_copy(update={"field": field})
    own = OrbitEnvironment(environment, stated.orbit_on_board(truth), truth.start)
    return OnBoardEphemeris(kind, find_models(own), find_elements(kind, own), own)


def _check(kind: str, truth: OrbitEnvironment, field) -> None:
    without = {
        "an orbit of kind 'bench'": isinstance(truth.orbit, Bench),
        f"a field of kind {field.kind!r}": not isinstance(field, _FIELDS),
        "environment.sun_direction": truth.environment.sun_direction is not None,
    }
    for what, is_there in without.items():
        if is_there:
            raise ValueError(f"ephemeris: must be left out with {what}; received {kind!r}")


def find_models(own: OrbitEnvironment) -> Models:
    """The constants of an orbit and its environment at the start."""
    model, year = own.environment.field, decimal_year(own.start)
    source = coefficients_name(model)
    if source is None:
        field, change, epoch = model.prepare(year), (0.0, 0.0, 0.0), year
    else:
        epoch, field, change = linear_piece(model, int(pieces(source, year)))
    is_precise = own.environment.earth_rotation == "precise"
    return Models(_expansion(field), _expansion(change), epoch, own.shadow, is_precise)


def _expansion(prepared) -> Harmonics:
    """What a model prepares as an expansion; a dipole vector [T m^3] is one of degree 1."""
    if isinstance(prepared, Harmonics):
        return prepared
    g, h = np.zeros((2, 2, 2))
    g[1, 1], h[1, 1], g[1, 0] = np.array(prepared) / FIELD_RADIUS_M**3
    return gauss.pack(g, h)


def instants(ephemeris: OnBoardEphemeris) -> np.ndarray:
    """Rows [n, 23] of the replay: time [s], given place (or zeros), ephemeris of the kernels."""
    t_s = np.arange(0.0, _LAST_S + 1.0, _EVERY_S)
    place = np.zeros((t_s.size, 6))
    if ephemeris.kind == "given":
        place = np.hstack(ephemeris.own.state(t_s))
    kind, models, elements, _ = ephemeris
    found = ephemeris_along(kind, models, elements, t_s, place[:, :3], place[:, 3:])
    return np.column_stack([t_s, place, found])


def translated_ephemeris(ephemeris: OnBoardEphemeris) -> tuple[Program, str, Record]:
    """The program of the kernels, the name of the first of them, the type of its constants."""
    models, names = _models_type(ephemeris.models), ELEMENTS[ephemeris.kind].names or ()
    elements = Record("adcs_elements", tuple((name, REAL) for name in names))
    kernel = KINDS[ephemeris.kind][0]
    place: list[Type] = [Tuple((REAL,) * 3)] * (2 if ephemeris.kind == "given" else 0)

    def build(program: Program):
        for each in (elements, models):
            program.type_name(each)
        return program.function(kernel, [models, elements, REAL, *place])

    program = translate_repeatedly(build, prefix="eph_")
    return program, build(program).name, models


def _models_type(models: Models) -> Record:
    fields = {name: find_type(value) or _harmonics_type(value)
              for name, value in models._asdict().items()}  # fmt: skip
    return Record("Models", tuple(fields.items()), True)


def _harmonics_type(expansion: Harmonics) -> Record:
    pairs = Array(expansion.pairs.shape, const=True)
    fields = (("radius_m", REAL), ("top", INT), ("top_order", INT), ("pairs", pairs))
    return Record("Harmonics", fields, True)
