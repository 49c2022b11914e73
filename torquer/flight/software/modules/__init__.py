"""Modules of the flight software, one file a module or a few that are alike.

`MODULES`: built-in ones in the order of their steps: drivers of sensors, then each module after
those whose output it takes; house-keeping, telemetry and communications come last.
"""

from torquer.flight.software.modules.actuators import Coils
from torquer.flight.software.modules.adc import Adc
from torquer.flight.software.modules.aos import Aos
from torquer.flight.software.modules.cdh import CdhModule
from torquer.flight.software.modules.clk import Clk
from torquer.flight.software.modules.com import Com
from torquer.flight.software.modules.drivers import Gyro, Mag, Sun
from torquer.flight.software.modules.fs import Fs
from torquer.flight.software.modules.mod import Mod
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.stb import Stb
from torquer.flight.software.modules.svr import Svr, Wdt
from torquer.flight.software.modules.tm import Tm
from torquer.flight.software.modules.wheels import Wheels

MODULES: dict[str, type[Module]] = {
    module.name: module
    for module in (
        *(Mag, Gyro, Sun, Mod, Aos, Stb, Coils, Wheels, Adc, Clk, Fs, Svr, Wdt),
        *(Tm, CdhModule, Com),
    )
}
