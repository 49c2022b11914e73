"""Hysteresis rods that no rod of their size is, or that a permanent magnet saturates."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.base.conventions import MU_0_H_M
from torquer.scenario.spec import Scenario
from torquer.spacecraft.disturbance.magnets import HysteresisRods

#: Length [m] beyond which no satellite has a rod.
_LONGEST_M = 3.0
#: Factor by which an apparent loop may be steeper than an ellipsoid of the rod's size allows.
_STEEPER = 2.0
#: Angle [deg] to a permanent magnet below which a rod lies along it.
_ALONG_DEG = 30.0


def magnet_notes(scenario: Scenario) -> list[str]:
    """Notes on hysteresis rods, one line each."""
    return [*assess(_CHECKS, scenario)]


def _size_notes(scenario: Scenario) -> Iterator[str]:
    """Sizes in millimetres, or exchanged."""
    for key, rods in _rods(scenario):
        if rods.length_m is None or rods.diameter_m is None:
            continue
        if rods.length_m > _LONGEST_M:
            yield f"{key}.length_m of {rods.length_m:g} is longer than any: is it in metres?"
        if rods.diameter_m >= rods.length_m:
            yield (
                f"{key}.diameter_m of {rods.diameter_m:g} is not below length_m of "
                f"{rods.length_m:g}: is this a rod, and are both in metres?"
            )


def _loop_notes(scenario: Scenario) -> Iterator[str]:
    """Numbers of the material: the poles of a rod make its loop flatter than mu_0/N."""
    for key, rods in _rods(scenario):
        if rods.length_m is None or rods.diameter_m is None or rods.diameter_m >= rods.length_m:
            continue
        steepness = math.tan(0.5 * math.pi * rods.remanence_t / rods.saturation_t)
        slope = 2.0 / math.pi * rods.saturation_t * steepness / rods.coercive_a_m
        greatest = MU_0_H_M / demagnetising_factor(rods.length_m / rods.diameter_m)
        if slope > _STEEPER * greatest:
            yield (
                f"{key} has a loop {slope / greatest:.2g} times as steep as the poles of a rod of "
                "this length and thickness allow: are remanence_t and saturation_t those of the "
                "material, not of the rod?"
            )


def _along_notes(scenario: Scenario) -> Iterator[str]:
    """A rod along the permanent magnet, whose field at the rods is left out."""
    magnet = np.array(scenario.spacecraft.permanent_magnet_a_m2)
    if not magnet.any():
        return
    for key, rods in _rods(scenario):
        along = abs(float(np.dot(magnet, rods.axis))) / float(np.linalg.norm(magnet))
        if along > math.cos(math.radians(_ALONG_DEG)):
            yield (
                f"{key} lies along permanent_magnet_a_m2, which would saturate it: the magnet's "
                "field at the rods is left out, and the damping is overstated"
            )


def demagnetising_factor(slenderness: float) -> float:
    """N of a prolate ellipsoid along its axis, by its length over its thickness (above 1)."""
    root = math.sqrt(slenderness**2 - 1.0)
    return (slenderness / root * math.log(slenderness + root) - 1.0) / root**2


def _rods(scenario: Scenario) -> list[tuple[str, HysteresisRods]]:
    found = scenario.spacecraft.hysteresis_rods
    return [(f"spacecraft.hysteresis_rods[{k}]", rods) for k, rods in enumerate(found)]


_CHECKS = {
    "the size of the hysteresis rods": _size_notes,
    "the loop of the hysteresis rods": _loop_notes,
    "the hysteresis rods along a magnet": _along_notes,
}
