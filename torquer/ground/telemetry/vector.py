"""Calibration of a magnetometer with a known attitude: the vector of its reading is the field's.

The reading m becomes A m + c, A any matrix: twelve parameters, four an axis, which hold scale,
non-orthogonality, soft iron and how the sensor is turned in the body. Linear least squares with
Tukey's weights on the length of the residual. A constant error of the attitude goes into A.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground.telemetry.calibration import (
    GROUPS,
    Calibration,
    complete_rows,
    covariance_of,
    tukey,
)
from torquer.ground.telemetry.environment import environments_at_rows
from torquer.ground.telemetry.undetermined import unknown_directions
from torquer.maths.geometry.attitudes import dcm_body_to_reference

#: Group of the parameters, rounds of weights, rows that are needed.
MODEL = ("bias", "matrix")
_ROUNDS, _LEAST_ROWS = 20, 24
#: Part of the rows, the nearest, by which fields are compared.
_COMPARED = 0.95


class KnownField(NamedTuple):
    """Field [n, 3] T in the body by the logged attitude, at rows [n] of a session that have one
    and a reading."""

    rows: np.ndarray
    field: np.ndarray

    def error(self, readings: np.ndarray) -> float:
        """Root mean square [T] of readings [all, 3] less the field, without the worst rows."""
        off = np.linalg.norm(readings[self.rows] - self.field, axis=1)
        off = np.sort(off[np.isfinite(off)])
        return float(np.sqrt(np.mean(off[: max(1, int(_COMPARED * len(off)))] ** 2)))


def known_field(data: xr.Dataset, along: OrbitEnvironment) -> KnownField | None:
    """The field by the attitudes of a session; None with too few. `along` starts at its first row;
    quaternions are body to J, as sessions hold them."""
    if "q_measured" not in data:
        return None
    q, m = data["q_measured"].values, data["b_measured"].values
    rows = np.flatnonzero(np.isfinite(q).all(axis=1) & np.isfinite(m).all(axis=1))
    if len(rows) < _LEAST_ROWS:
        return None
    b = environments_at_rows(data, along).b[rows]
    return KnownField(rows, np.einsum("nji,nj->ni", dcm_body_to_reference(q[rows]), b))


def calibrate_vector(data: xr.Dataset, field, known: KnownField) -> Calibration:
    """Bias and matrix of the magnetometer of a session by its known field.

    `field`: `FieldAlong` or `FieldGiven` of the session. `residual`: the length of the corrected
    reading less the field's strength [T], as of all calibrations; the weights are by the whole
    vector, 1 for rows without an attitude.
    """
    m = data["b_measured"].values[known.rows]
    unit = float(np.median(np.linalg.norm(known.field, axis=1)))
    columns = np.column_stack([m / unit, np.ones(len(m))])
    weight = np.ones(len(m))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(root * columns, root * known.field / unit, rcond=1e-12)[0]
        off = unit * np.linalg.norm(columns @ found - known.field / unit, axis=1)
        sigma = 1.4826 * float(np.median(off)) + 1e-12
        weight, _ = tukey(off, sigma)
    left = unit * (columns @ found) - known.field
    matrix, shift = found[:3].T, unit * found[3]
    bias = -np.linalg.solve(matrix, shift)
    covariance = _covariance(left, columns, weight, matrix, bias, unit)
    names = tuple(name for group in MODEL for name in GROUPS[group].names)
    values = np.concatenate([bias, (matrix - np.eye(3)).ravel()])
    rows, kept, _ = complete_rows(data, field)
    weights = np.ones(data.sizes["time"])
    weights[known.rows] = weight
    sizes = np.concatenate([[GROUPS[g].size] * len(GROUPS[g].names) for g in MODEL])
    return Calibration(
        MODEL,
        names,
        values,
        covariance,
        float(np.sqrt(np.mean(left[weight > 0.0] ** 2))),
        np.linalg.norm((rows.m - bias) @ matrix.T, axis=1) - field.strength(rows.t_s)[0],
        weights[kept],
        0.0,
        unknown_directions(names, covariance / np.outer(sizes, sizes)),
    )


def _covariance(left, columns, weight, matrix, bias, unit: float) -> np.ndarray:
    """Covariance [12, 12] of bias and matrix, of each axis with its correlated residuals."""
    rows = weight > 0.0
    whole = np.zeros((12, 12))  # of the rows of (A, c / unit), an axis after the other
    for axis in range(3):
        part = slice(4 * axis, 4 * axis + 4)
        residual = left[rows, axis] / unit
        spread = 1.4826 * float(np.median(np.abs(residual))) + 1e-15
        whole[part, part] = covariance_of(residual, columns[rows], spread)[0]
    inverse = np.linalg.inv(matrix)
    turn = np.zeros((12, 12))
    for axis in range(3):
        # bias = -A^-1 c: a change dA of A and dc of c moves it by -A^-1 (dA bias + dc)
        for column in range(3):
            turn[:3, 4 * axis + column] = -inverse[:, axis] * bias[column]
            turn[3 + 3 * axis + column, 4 * axis + column] = 1.0
        turn[:3, 4 * axis + 3] = -inverse[:, axis] * unit
    return turn @ whole @ turn.T
