"""A mode table evaluated reading by reading."""

import numpy as np
from known import record_of

from torquer.computer.inputs import Inputs, ReadingTimes
from torquer.computer.interface import UNKNOWN_ESTIMATE, Ephemeris
from torquer.computer.modes.spec import Modes
from torquer.computer.modes.table import switch_modes

J = (1.0, 1.1, 1.5)
Z = (0.0, 0.0, 1.0)
ZERO = (0.0, 0.0, 0.0)
ESTIMATE = UNKNOWN_ESTIMATE._replace(
    t_s=0.0, q_body_to_inertial=(0.0, 0.0, 0.0, 1.0), omega_body_rad_s=(0.01, 0.02, 0.05)
)


def reading(
    t_s=0.0,
    sun=ZERO,
    sunlit_fraction=np.nan,
    b=ZERO,
    wheels=ZERO,
    read_at=None,
    place=None,
    **estimate,
):
    """Inputs at a time; what is left of the keys belongs to the estimate. `place`: (r, v)."""
    ephemeris = Ephemeris(sunlit_fraction=float(sunlit_fraction))
    if place is not None:
        r, v = map(_floats, place)
        ephemeris = ephemeris._replace(r_inertial_m=r, v_inertial_m_s=v)
    believed = ESTIMATE._replace(**{k: _floats(v) for k, v in estimate.items()})
    read_at = read_at or ReadingTimes()
    return Inputs(
        float(t_s),
        b_body_t=_floats(b),
        sun_body=_floats(sun),
        q_body_to_inertial=(0.0, 0.0, 0.0, 1.0),
        wheel_momentum_body_n_m_s=_floats(wheels),
        read_at=read_at,
        estimate=believed,
        ephemeris=ephemeris,
    )


def _floats(value):
    return float(value) if np.isscalar(value) else tuple(map(float, value))


def spinning(deg_s):
    """A rate about the third axis."""
    return {"omega_body_rad_s": (0.0, 0.0, np.radians(deg_s))}


class Flown:
    """The table of `Modes(**keys)`, with the names of its states."""

    def __init__(self, modes=None, **keys):
        self.modes = modes or Modes(**keys)
        self.names = [name for r in self.modes.regions.values() for name in r.states]
        laws = {
            law for r in self.modes.regions.values() for s in r.states.values() for law in s.laws
        }
        self.table, self.state = self.modes.pack({law: i for i, law in enumerate(sorted(laws))})

    def __call__(self, inputs):
        """Whether a state was entered."""
        return bool(switch_modes(self.table, self.state, record_of(inputs)))

    @property
    def now(self):
        """The state of each region, by name."""
        return [self.names[int(number)] for number in self.state.regions["state"]]

    def states(self, readings):
        """The first region's state after each reading."""
        found = []
        for inputs in readings:
            self(inputs)
            found.append(self.now[0])
        return found


def two_states(**transition):
    """A region of `a`, which a transition leads out of, and `b`."""
    return {"states": {"a": {"transitions": [{"to": "b", **transition}]}, "b": {"final": True}}}
