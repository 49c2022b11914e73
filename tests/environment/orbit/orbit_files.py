"""Orbit files of all formats, written from SGP4: what they hold is known at every instant."""

from datetime import timedelta

import erfa
import numpy as np

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.base.time import parse_utc, tai_minus_utc
from torquer.environment.earth.rotation import dcm_inertial_to_ecef, teme_to_gcrf
from torquer.environment.orbit import Sgp4
from torquer.maths.geometry.frames import geodetic_from_ecef

TLE = (
    "1 25544U 98067A   25182.50000000  .00008000  00000-0  14800-3 0  9990",
    "2 25544  51.6370 240.0000 0002000  90.0000 270.0000 15.50000000517000",
)
ISS = Sgp4(tle=[line[:68] for line in TLE], without_checksums=True)
START = parse_utc("2025-07-01T12:00:00Z")


def gcrf(t_s):
    """Position and velocity in GCRF at seconds after the start."""
    t_s = np.asarray(t_s, dtype=float)
    turn = teme_to_gcrf(t_s, START)
    return tuple(np.einsum("nij,nj->ni", turn, x) for x in ISS.state(t_s, START))


def ecef(t_s):
    """Position and velocity in Earth-fixed axes."""
    r, v = gcrf(t_s)
    turn = dcm_inertial_to_ecef(np.asarray(t_s, dtype=float), START)
    r, v = (np.einsum("nij,nj->ni", turn, x) for x in (r, v))
    return r, v - np.cross((0.0, 0.0, EARTH_RATE_RAD_S), r)


def times(span_s=7200.0, step_s=60.0, before_s=600.0):
    """Instants of a file."""
    return np.arange(-before_s, span_s + 0.5 * step_s, step_s)


def stamp(t_s, ahead_s=0.0) -> str:
    """ISO text of an instant, by a clock that is ahead of UTC."""
    return (START + timedelta(seconds=float(t_s + ahead_s))).strftime("%Y-%m-%dT%H:%M:%S.%f")


def ahead_s(scale: str) -> float:
    """Seconds by which a scale is ahead of UTC."""
    tai = float(tai_minus_utc(np.datetime64(START.replace(tzinfo=None), "us")))
    return {"UTC": 0.0, "TAI": tai, "GPS": tai - 19.0, "TT": tai + 32.184}[scale]


def oem_text(t_s, axes="EME2000", scale="UTC", places=ecef, rows=None) -> str:
    """An OEM of the ISS."""
    if axes in ("EME2000", "GCRF"):
        r, v = gcrf(t_s)
        if axes == "EME2000":
            bias = erfa.bp06(2451545.0, 0.0)[0]
            r, v = r @ bias.T, v @ bias.T
    elif axes == "TEME":
        r, v = ISS.state(t_s, START)
    else:
        r, v = ecef(t_s)
    lines = [
        f"{stamp(t, ahead_s(scale))} " + " ".join(f"{1e-3 * x:.9f}" for x in (*a, *b))
        for t, a, b in zip(t_s, r, v, strict=True)
    ]
    head = [
        "CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2025-06-30T00:00:00", "ORIGINATOR = NOBODY", "",
        "META_START", "OBJECT_NAME = ISS", "OBJECT_ID = 1998-067-A", "CENTER_NAME = EARTH",
        f"REF_FRAME = {axes}", f"TIME_SYSTEM = {scale}", "META_STOP", "COMMENT positions",
    ]  # fmt: skip
    return "\n".join(head + lines) + "\n"


def csv_text(t_s, with_velocities=True, scale="GPS", geodetic=False) -> str:
    """A GNSS log: Earth-fixed places by GPS time."""
    r, v = ecef(t_s)
    names = ["x_m", "y_m", "z_m"] + (["vx_m_s", "vy_m_s", "vz_m_s"] if with_velocities else [])
    columns = [*r.T, *v.T] if with_velocities else [*r.T]
    if geodetic:
        lat, lon, height = geodetic_from_ecef(r)
        names = ["lat_deg", "lon_deg", "height_m"]
        columns = [np.degrees(lat), np.degrees(lon), height]
    lines = [
        ",".join([stamp(t, ahead_s(scale)), *(f"{x:.12g}" for x in row)])
        for t, row in zip(t_s, np.transpose(columns), strict=True)
    ]
    return "\n".join([",".join([scale.lower(), *names]), *lines]) + "\n"


def sp3_text(t_s, with_velocities=False, name="L51", axes="IGS20", scale="GPS") -> str:
    """An SP3 file of one satellite, by GPS time, in kilometres and decimetres a second."""
    r, v = ecef(t_s)
    flag = "V" if with_velocities else "P"
    lines = [f"#d{flag}2025  7  1 12  0  0.00000000{len(t_s):8d} ORBIT {axes:5s} FIT  TST"]
    lines += ["## 2373 216000.00000000    60.00000000 60857 0.5000000000000", f"+    1   {name}"]
    lines += [f"%c L  cc {scale} ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc"]
    for t, a, b in zip(t_s, r, v, strict=True):
        at = START + timedelta(seconds=float(t + ahead_s(scale)))
        lines.append(f"*  {at:%Y %m %d %H %M} {at.second + 1e-6 * at.microsecond:11.8f}")
        lines.append(f"P{name}" + "".join(f"{1e-3 * x:14.6f}" for x in a) + f"{0.0:14.6f}")
        if with_velocities:
            lines.append(f"V{name}" + "".join(f"{10.0 * x:14.6f}" for x in b) + f"{0.0:14.6f}")
    return "\n".join([*lines, "EOF"]) + "\n"
