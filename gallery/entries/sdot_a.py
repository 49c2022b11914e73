"""SDOT App. A: packets, boot, queues, clock and modules of the flight software, as flown.

The example of Chibis-M's flight software is rebooted in flight; what its computer does, sends and
keeps is compared with the structures and sequences that the appendix prints.
"""

import struct
from datetime import timedelta
from pathlib import Path
from textwrap import wrap

import numpy as np

from gallery.drawing import BLUE, GREEN, label, new_figure
from gallery.entry import Answer, Entry, lost, near, within
from torquer import load_scenario
from torquer.flight.packets.frames import FRAMESYNC, HEADER_BYTES, Downlink, Stream, Uplink
from torquer.flight.software import boot
from torquer.flight.software.clock import STEP_MS, Clock, to_ms
from torquer.flight.software.core import Core
from torquer.flight.software.modules.clk import TIME
from torquer.flight.software.queues import Cdh
from torquer.flight.software.state import COMMANDS, QUEUES

EXAMPLE = Path(__file__).parents[2] / "examples/chibis_m_flight.toml"
#: Time [s] of the reboot, and of the flight.
REBOOT_S, END_S = 100.0, 1000.0
#: The boot in the order of the appendix, by the beginnings of our names of its steps: from
#: drv_start_control to the acknowledgement of the supervisor.
BOOT = ("drivers", "global variables", "current sensors", "file system", "FPGA", "modules", "time",
        "supervisor: power", "supervisor: modules", "supervisor: watchdog", "ready")  # fmt: skip
#: Svr_select_mode, and the base modules and drivers of elements of Table A.1 (the communications
#: driver is our link; drivers of buses have no part in a simulation, but for ADC and WDT).
STARTED = ("cdh", "tm", "mod", "aos", "stb", "com")
BASE = ("svr", "stb", "aos", "tm", "com", "cdh", "mod")
DRIVERS = ("wheels", "coils", "gyro", "mag", "sun", "fs", "adc", "wdt")


def rebooted() -> tuple[Core, list[str], np.ndarray, np.ndarray, list[float]]:
    """A flight with a reboot: the core; modules in the order in which they were started; times [s],
    and whether the software runs at them; times [s] at which the clock was saved."""
    core = Core(load_scenario(EXAMPLE).replace("simulation.duration_s", END_S))
    started: list[str] = []
    saved: list[float] = []
    _listen(core, started, saved)
    times, runs = [], []
    while core.tick() is not None:
        times.append(core.services.t_s)
        runs.append(core.is_running)
        if times[-1] == REBOOT_S:
            core.reboot()
    return core, started, np.array(times), np.array(runs), saved


def _listen(core: Core, started: list, saved: list) -> None:
    """Note which modules are started, and when the clock is saved."""
    start, write = core.services.start, core.memory.write

    def noting_start(name):
        started.append(name)
        start(name)

    def noting_write(name, data):
        if name == TIME:
            saved.append(core.services.t_s)
        return write(name, data)

    vars(core.services)["start"], vars(core.memory)["write"] = noting_start, noting_write


def of_packets(core: Core) -> tuple:
    """Headers, beacon, and that both kinds of commands pass."""
    dictionary = core.software.dictionary
    beacon = dictionary.down["beacon"]
    values = [0] * len(beacon.names)
    frame = Downlink(dictionary).frame("beacon", 0.0, values)
    up = Uplink(dictionary)
    commands = [p for p in dictionary.up.values() if p.names[0] == "acknowledge"]
    bare = [p for p in commands if len(p.names) == 1]
    (received,) = Stream(dictionary, "up").feed(up.frame(bare[0].name, 0.0, (1,)))
    return (
        near("bytes of the uplink header", "16", len(up.frame(bare[0].name, 0.0, (1,)))
             - bare[0].size, "B", printed="4 + 4 + 1 + 1 + 4 + 2 bytes"),
        near("bytes of the downlink header", "16", len(frame) - beacon.size, "B",
             printed="4 + 4 + 1 + 1 + 4 + 2 bytes"),
        near("bytes of the standard telemetry", "8", beacon.size, "B",
             printed="5 x 1 + 2 + 1 bytes"),
        within("beginning of a frame less 0xAABBCCDD", "framesync 0xAABBCCDD",
               struct.unpack("<I", frame[:4])[0] - 0xAABBCCDD, 0.0, 0.0),
        within("commands without arguments, of " f"{len(commands)}", "a command has no arguments",
               len(bare) if received.packet is bare[0] else 0, low=1.0),
        within("commands with parameters", "a command may have parameters, too",
               len(commands) - len(bare), low=1.0),
    )  # fmt: skip


def of_boot(started, times, runs) -> tuple:
    """Order of the steps and of the modules."""
    names = [step.name for step in boot.STEPS[1:]]
    right = [name.startswith(begin) for name, begin in zip(names, BOOT, strict=True)]
    last = [name for name in started if name in STARTED][-len(STARTED) :]
    done = times[(times > REBOOT_S) & runs][0]
    return (
        within(f"steps of the boot at their printed place, of {len(BOOT)}", "drivers to 'ready'",
               sum(right), low=len(BOOT)),
        within("modules started at their printed place, of 6", "CDH, TM, MOD, AOS, STB, COM",
               sum(a == b for a, b in zip(last, STARTED, strict=True)), low=6.0),
        lost("from the reboot to 'ready'", done - REBOOT_S, "s"),
    )  # fmt: skip


def of_queues(core: Core) -> tuple:
    """Sizes, and what a full queue does."""
    sizes = [*QUEUES.values(), COMMANDS]
    queue = Cdh({"state": 3})
    answers = [queue.put("state", number) for number in range(4)]
    return (
        within("elements of a queue, least", "from 3 to 10", min(sizes), 3.0, 10.0),
        within("elements of a queue, greatest", "from 3 to 10", max(sizes), 3.0, 10.0),
        within("oldest element after four in a queue of three", "the oldest is removed",
               queue.take("state"), 1.0, 1.0),
        within("elements whose sender gets an error", "else the sender gets an error",
               answers.count(False), 1.0, 1.0),
    )  # fmt: skip


def of_modules(core: Core, saved) -> tuple:
    """Table A.1, and the clock."""
    modules = core.software.modules
    later = np.diff([t for t in saved if t > REBOOT_S + 60.0])
    return (
        within("base modules of Table A.1, of 7", "SVR, STB, AOS, TM, COM, CDH, models",
               sum(name in modules for name in BASE), low=7.0),
        within("drivers of elements, ADC and watchdog of Table A.1, of 8",
               "wheels, coils, gyro, magnetometer, Sun sensors, JFFS2, ADC, WDT",
               sum(name in modules for name in DRIVERS), low=8.0),
        near("step of the on-board clock", "10", STEP_MS, "ms", printed="about 10 ms"),
        near("time between two savings of the clock", "1", np.median(later) / 60.0, "min",
             0.1, "about once a minute"),
        within("time that the clock has lost after the reboot", "continues from the last saving",
               lost_by_clock_s(core, saved[-1]), 0.0, 60.0 + boot.BOOT_S + 1.0, "s"),
    )  # fmt: skip


def lost_by_clock_s(core: Core, saved_s: float) -> float:
    """How far the on-board clock, as it was last saved, was behind the time of the flight."""
    clock = Clock()
    clock.restore(core.memory.read(TIME))
    now = load_scenario(EXAMPLE).start + timedelta(seconds=saved_s)
    return 1e-3 * (to_ms(now) - clock.now_ms)


def compute() -> Answer:
    """A reboot in flight, and what is kept and sent."""
    core, started, times, runs, saved = rebooted()
    checks = (*of_packets(core), *of_boot(started, times, runs), *of_queues(core),
              *of_modules(core, saved))  # fmt: skip
    note = (
        f"A reboot after {REBOOT_S:.0f} s of examples/chibis_m_flight.toml. The software was made "
        "from the text: what agrees is that it does what the text says. Chosen, as the text has "
        "none: durations of the steps of the boot, byte order and packing. Drivers of I2C, SPI, "
        "RS485, CAN and of the parallel bus have no part in a simulation; their steps of the boot "
        "take their time. That a command has no arguments and that it may have parameters stand in "
        "the same appendix: both kinds fly. Frame marks are "
        f"0x{FRAMESYNC:X}, headers {HEADER_BYTES} bytes."
    )
    return Answer(checks, {"": picture(started)}, note)


def picture(started):
    """The boot over time, and the modules in the order of their start."""
    figure, (axes,) = new_figure("Boot of Chibis-M's flight software (SDOT App. A)", height=4.4)
    begin = 0.0
    for row, step in enumerate(boot.STEPS):
        axes.barh(row, step.duration_s, left=begin, color=GREEN if row == 9 else BLUE, height=0.6)
        axes.text(begin + step.duration_s + 0.1, row, step.name, va="center", fontsize=9.0)
        begin += step.duration_s
    shown = "\n".join(wrap("modules in the order of their start: " + ", ".join(started), 58))
    axes.text(0.1, 9.2, shown, fontsize=8.5, color="#555555", va="top", linespacing=1.4)
    axes.set(xlim=(0.0, 14.5), ylim=(11.6, -0.7), yticks=[])
    label(axes, "time after the reset [s]; durations are chosen", "", legend=False)
    return figure


ENTRY = Entry(ids=("SDOT-A",), compute=compute, slow=True)
