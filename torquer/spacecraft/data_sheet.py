"""What the keys of a device say of it, as data: for rules that hold for every device."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

#: Of a Gauss-Markov process: greatest Allan deviation over its standard deviation.
FLOOR = 0.6173642831444414
#: Units of what has another unit than the readings.
_UNITS = {
    "scale": "",
    "soft_iron": "",
    "misalignment": "deg",
    "height": "km",
    "rate_limit": "deg/s",
}
#: What errors are called that are not the device's own.
_WORDS = {
    "by_coils": "the coils' own dipole",
    "by_each_coil": "the coils' own dipole",
    "by_driver": "the coils' driver",
    "soft_iron": "soft iron",
}


class DataSheet(NamedTuple):
    """Keys by which a device says how good it is; "" for what it has no key for.

    `name`: of one of them, in words; `senses`: its quantity, "" for one that no rule knows a size
    of; `unit`: that of noise, bias, range and resolution. `noise`: of each component of a reading;
    `noise_about`: about a boresight, where it is another; `drift`: random walk of the bias;
    `scale`: relative errors, `random_scale`: drawn each time; `misalignment`: turns [deg];
    `albedo`: of the Earth whose light misleads it; `height`: of the horizon [km]; `rate_limit`:
    rate of the body [deg/s] above which there is no reading; `by_coils`: what it reads of the
    coils' own dipole [unit per A m^2], `by_each_coil`: a vector for each, `by_driver`: of their
    driver; `soft_iron`: its matrix; `axes`: how it is mounted. `white`: of a rate, noise times the
    root of the interval between its readings, whatever this is; `instability`: floor of the Allan
    deviation, which a bias with a `correlation` time [s] makes; `quantum`: of an accumulated angle,
    its unit that of the readings' angle. `words`: for an error not called by the device and its
    own name; `factors`: by which the values of a key become of the unit of the others.
    """

    name: str
    senses: str
    unit: str
    noise: str = ""
    noise_about: str = ""
    bias: str = ""
    drift: str = ""
    range: str = ""
    resolution: str = ""
    scale: str = ""
    random_scale: str = ""
    misalignment: str = ""
    albedo: str = ""
    height: str = ""
    rate_limit: str = ""
    by_coils: str = ""
    by_each_coil: str = ""
    by_driver: str = ""
    soft_iron: str = ""
    axes: str = ""
    white: str = ""
    instability: str = ""
    correlation: str = ""
    quantum: str = ""
    words: Mapping[str, str] = {}
    factors: Mapping[str, float] = {}

    def value(self, device, what: str) -> np.ndarray | None:
        """What a device states of one of these; None without a key for it or where left out."""
        key = getattr(self, what)
        given = getattr(device, key) if key else None
        if given is None:
            return None
        return np.asarray(given, dtype=np.float64) * self.factors.get(what, 1.0)

    def unit_of(self, what: str) -> str:
        """Unit of one of these."""
        return _UNITS.get(what, self.unit)

    def in_words(self, what: str) -> str:
        """What an error of the device is called."""
        if what in _WORDS:
            return _WORDS[what]
        return self.words.get(what, f"{self.name} {what}")


#: Errors of a device that stay as they are through a run.
FIXED = ("bias", "scale", "misalignment", "height")


class Assumed(NamedTuple):
    """What a key on board says of a device: the key, the device, what of its `DataSheet`.

    'white' is the noise of a rate times the root of the interval of its readings.

    `sigmas`: how many times the key's value a fixed error may have, for a key that states the size
    of one; 0 for others.
    """

    key: str
    device: str
    what: str
    sigmas: float = 0.0
