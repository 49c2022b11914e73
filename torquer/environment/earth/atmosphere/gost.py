"""GOST R 25645.166-2004: density of the upper atmosphere, 120-1500 km, for ballistics."""

import json
import math
from functools import cache
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base import validate
from torquer.environment.earth.atmosphere.air import GOST, Air, GostAir
from torquer.environment.earth.atmosphere.model import Atmosphere

FOLDER = Path(__file__).parents[1] / "coefficients"
_GROUPS = {"a": 7, "l": 5, "c": 5, "d": 5, "b": 5, "e": 5}
DAYS_OF_F81 = 81


@cache
def _tables() -> dict:
    return json.loads((FOLDER / "gost_r_25645_166_2004.json").read_text(encoding="utf-8"))


def kp_from_ap(ap: float) -> float:
    """Daily Kp of a daily Ap by the standard's table A.1, linear between its entries."""
    table = _tables()["Ap_at_Kp_thirds"]
    return float(np.interp(ap, table, np.arange(len(table)) / 3.0))


def mean_f107(f107_daily) -> float:
    """Weighted mean of the F10.7 of 81 days, today last: the weights rise from 0.5 to 1."""
    values = validate.finite("f107_daily", f107_daily, (DAYS_OF_F81,))
    return float(np.average(values, weights=np.linspace(0.5, 1.0, DAYS_OF_F81)))


def _group(table: dict, name: str, column: int) -> list[float]:
    """Coefficients of a group's polynomial, filled up to seven powers."""
    size = _GROUPS[name]
    return [table[name][f"{name}{i}"][column] for i in range(size)] + [0.0] * (7 - size)


class Gost(Atmosphere):
    """GOST R 25645.166-2004 with fixed indices of solar and geomagnetic activity.

    One of `kp`, `ap` and `kp_3h` is given.
    """

    kind: Literal["gost"] = "gost"
    f107: float = Field(ge=50.0, le=500.0)
    """Solar index F10.7 of the day, as it was 1.7 days before."""
    f81: float | None = Field(default=None, ge=60.0, le=300.0)
    """Weighted mean of F10.7 over 81 days (`mean_f107`); left out: f107."""
    kp: float | None = Field(default=None, ge=0.0, le=9.0)
    """Daily mean of the geomagnetic index Kp, as it was 0.6 days before."""
    ap: float | None = Field(default=None, ge=0.0, le=400.0)
    """Daily geomagnetic index Ap, converted to Kp by the standard's table."""
    kp_3h: float | None = Field(default=None, ge=0.0, le=9.0)
    """Three-hour geomagnetic index Kp, as it was 0.25 days before."""
    heights_km: ClassVar = (120.0, 1500.0)

    @model_validator(mode="after")
    def _check(self):
        given = [key for key in ("kp", "ap", "kp_3h") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(
                "atmosphere gost: must have one of kp, ap and kp_3h; received "
                f"{', '.join(given) or 'none of them'}"
            )
        if self.f81 is None and not 60.0 <= self.f107 <= 300.0:
            raise ValueError(
                f"f107: must lie within 60..300 where f81 is left out; received {self.f107:g}"
            )
        return self

    def pack(self) -> Air:
        """Constants for kernels."""
        tables = _tables()
        low, high = tables["table_low"], tables["table_high"]
        f81 = self.f107 if self.f81 is None else self.f81
        columns = np.array(tables["columns_F0"])
        column = int(np.argmin(np.abs(columns - f81)))
        f0 = float(columns[column])
        gost = GostAir(
            night=tables["rho_0"],
            polynomials=np.array([[_group(t, g, column) for g in _GROUPS] for t in (low, high)]),
            above_km=np.array([high[g]["h_limit"][column] for g in _GROUPS]),
            bulge_power=tuple(low["n"][f"n{i}"][column] for i in range(3)),
            lag_rad=low["phi1"][column],
            annual=np.array(tables["A_day_of_year"]),
            level=(f81 - f0) / f0,
            flux=(self.f107 - f81) / (f81 + abs(self.f107 - f81)),
            storm=self._storm(low, column),
        )
        return Air(GOST, *self.heights_km, np.zeros((1, 3)), gost)

    def _storm(self, table: dict, column: int) -> float:
        """The second factor of the correction for geomagnetic activity."""
        name, kp = ("et", self.kp_3h) if self.kp_3h is not None else ("e", self.kp)
        if self.ap is not None:
            kp = kp_from_ap(self.ap)
        return math.fsum(table[name][f"{name}{5 + i}"][column] * kp**i for i in range(4))
