"""Modules of the flight software, one file a module or a few that are alike.

`MODULES`: built-in ones in the order of their steps: drivers of sensors, then each module after
those whose output it takes; telemetry and communications come last.
"""

from torquer.onboard.modules.actuators import Coils, Wheels
from torquer.onboard.modules.aos import Aos
from torquer.onboard.modules.cdh import CdhModule
from torquer.onboard.modules.clk import Clk
from torquer.onboard.modules.com import Com
from torquer.onboard.modules.drivers import Adc, Gyro, Mag, Sun
from torquer.onboard.modules.fs import Fs
from torquer.onboard.modules.mod import Mod
from torquer.onboard.modules.module import Module
from torquer.onboard.modules.stb import Stb
from torquer.onboard.modules.svr import Svr, Wdt
from torquer.onboard.modules.tm import Tm

MODULES: dict[str, type[Module]] = {
    module.name: module
    for module in (
        *(Adc, Mag, Gyro, Sun, Mod, Aos, Stb, Coils, Wheels, Clk, Fs, Svr, Wdt),
        *(Tm, CdhModule, Com),
    )
}
#: Modules without which the software does not fly.
REQUIRED = ("cdh", "com", "svr", "wdt")
