"""Tachometers: the momenta of the wheels, which the loop reads wheel by wheel."""

from torquer.spacecraft.sensors.device import Device

DEVICE = Device(
    "tachometers",
    given="wheel_momentum_body_n_m_s",
    said="tachometers",
    symbol="wheel_momentum",
    units="N m s",
    meaning="sum of the wheels' momenta by the last readings of their tachometers",
    may_stay=True,
)
