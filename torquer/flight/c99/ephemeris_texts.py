"""Texts of the ephemeris on board: its header, its file, its part of the README."""

from string import Template

from torquer.base.version import VERSION
from torquer.computer.on_board_environment import ELEMENTS
from torquer.environment.orbit.secular import EARTH_J2
from torquer.flight.c99.ephemeris import OnBoardEphemeris, translated_ephemeris
from torquer.flight.c99.precision import computing_in, double_text, is_single
from torquer.flight.c99.print_c import INCLUDES, program_text, types_text
from torquer.flight.c99.tables import constant_text
from torquer.flight.c99.texts import fill_template, self_test

#: What each element is.
MEANINGS = {
    "start_day": "Julian date (UTC) of t_s = 0: a whole or half number of days",
    "start_fraction": "and the rest of it [days]",
    "ut1_minus_utc_s": "UT1 - UTC [s], by Bulletin A of the IERS; 1 ms turns the Earth by 0.5 m",
    "tt_minus_utc_s": "TT - UTC [s]: 32.184 and the leap seconds",
    "epoch_day": "Julian date (UTC) of the epoch: a whole or half number of days",
    "epoch_fraction": "and the rest of it [days]",
    "semi_major_axis_m": "mean semi-major axis [m]",
    "mean_motion_rev_day": "mean motion [revolutions a day], line 2, columns 53-63",
    "eccentricity": "eccentricity",
    "inclination_deg": "inclination [deg]",
    "raan_deg": "right ascension of the ascending node [deg]",
    "argument_of_perigee_deg": "argument of perigee [deg]",
    "mean_anomaly_deg": "mean anomaly [deg]",
    "j2": f"{EARTH_J2} for the drift of node and perigee; 0: two bodies, no drift",
    "drag_term": "drag term B* [1/Earth radii], line 1, columns 54-61",
}
_COLUMNS = {
    "eccentricity": "27-33", "inclination_deg": "9-16", "raan_deg": "18-25",
    "argument_of_perigee_deg": "35-42", "mean_anomaly_deg": "44-51",
}  # fmt: skip
_HOW = {
    "given": "at the position and velocity that are handed in",
    "kepler": "at the position and velocity of a Kepler orbit that drifts by J2",
    "sgp4": "at the position and velocity that SGP4 gives",
}

_GIVEN = """\
    const eph_vec3 r = {{inputs->r_inertial_m[0], inputs->r_inertial_m[1],
        inputs->r_inertial_m[2]}};
    const eph_vec3 v = {{inputs->v_inertial_m_s[0], inputs->v_inertial_m_s[1],
        inputs->v_inertial_m_s[2]}};
"""
#: In a program of single precision these doubles are computed by the library of the processor.
_PORTABLE = """\
#ifndef ADCS_PORTABLE
#define ADCS_PORTABLE /* doubles, unlike the control step: the same bits with every library */
#endif
"""

_TLE = """\
Angles and eccentricity stand in line 2 of two-line elements, in the columns
$columns;
the eccentricity has a decimal point before its digits. Orbits with a period of 225 minutes or more
are SDP4's, which is not here: `adcs_ephemeris` returns false.

"""
_TWO_BODIES = """\
The scenario's orbit is that of two bodies, so `j2` is 0 at the start and nothing drifts. The
node of a satellite in low orbit drifts by up to 8 deg a day: set `j2` for flight.

"""


def ephemeris_files(ephemeris: OnBoardEphemeris, name: str) -> dict[str, str]:
    """The header and the source."""
    kind, general = ephemeris.kind, {"name": name, "version": VERSION}
    members = "".join(f"    double {each}; /* {MEANINGS[each]} */\n" for each in _values(ephemeris))
    axes = "GCRF" if ephemeris.models.is_precise else "true equator, mean equinox (TEME)"
    nowhere = {
        "given": "", "kepler": ":\n   elements of no ellipse",
        "sgp4": ":\n   elements of deep space, or a satellite come down",
    }[kind]  # fmt: skip
    header = general | {
        "how": _HOW[kind], "axes": axes, "members": members, "nowhere": nowhere,
        "place": "; position and velocity are read" if kind == "given" else "",
    }  # fmt: skip
    return {
        "adcs_ephemeris.h": fill_template("adcs_ephemeris.h", header),
        "adcs_ephemeris.c": fill_template("adcs_ephemeris.c", general | _source_text(ephemeris)),
    }


def _values(ephemeris: OnBoardEphemeris) -> dict[str, float]:
    """The elements at the start by name."""
    names = ELEMENTS[ephemeris.kind].names or ()
    return dict(zip(names, ephemeris.elements[0].tolist(), strict=True))


def _source_text(ephemeris: OnBoardEphemeris) -> dict[str, str]:
    portable = _PORTABLE if is_single() else ""
    arguments = ["&constants", "elements", "inputs->t_s"]
    if ephemeris.kind == "given":
        arguments += ["r", "v"]
    with computing_in("double"):
        program, kernel, models = translated_ephemeris(ephemeris)
        values = _values(ephemeris).items()
        return {
            "portable": portable, "includes": INCLUDES, "kernel": kernel,
            "types": types_text(program, ("adcs_elements",)),
            "constants": constant_text(program, models, "constants", ephemeris.models),
            "program": program_text(program, False, (kernel,)),
            "first": "".join(f"        /* {k} */ {double_text(v)},\n" for k, v in values),
            "given": _GIVEN if ephemeris.kind == "given" else "", "arguments": ", ".join(arguments),
            **self_test(("double",)),
        }  # fmt: skip


def ephemeris_readme(ephemeris: OnBoardEphemeris) -> str:
    """The section of the README."""
    rows = "".join(
        f"| `{name}` | {value!r} | {MEANINGS[name]} |\n"
        for name, value in _values(ephemeris).items()
    )
    columns = ", ".join(f"`{name}` {columns}" for name, columns in _COLUMNS.items())
    places = {"how": _HOW[ephemeris.kind], "rows": rows, "model": _model(ephemeris)}
    has_two_bodies = _values(ephemeris).get("j2") == 0.0
    more = _TLE if ephemeris.kind == "sgp4" else _TWO_BODIES if has_two_bodies else ""
    return fill_template("ephemeris.md", places) + Template(more).substitute(columns=columns)


def _model(ephemeris: OnBoardEphemeris) -> str:
    """What the field is."""
    field, models = ephemeris.own.environment.field, ephemeris.models
    changes = models.change.pairs.any()
    rate = f", its coefficients of {models.epoch_year:g} with their change by the year"
    return (
        f"The field is `{field.kind}` to degree {models.field.top - 1}{rate if changes else ''}.\n"
        "From 1990 to 2060 the Sun is within 0.01 deg and the Earth's axes within 0.2 arcsec of\n"
        "those of the simulation."
    )
