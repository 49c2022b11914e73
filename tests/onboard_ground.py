"""A ground segment for tests: commands up, packets down, both links."""

from torquer.flight.packets.frames import Stream, Uplink
from torquer.flight.packets.protected import CommandSender, TelemetryReceiver
from torquer.flight.software.core import Core
from torquer.scenario.load import load_scenario

DAY, ALL_MODES = "examples/chibis_m_day.toml", "examples/chibis_m_flight.toml"


def scenario(duration_s=600.0, file=DAY, **keys):
    """The day of Chibis-M, shorter, or another example."""
    found = load_scenario(file).replace("simulation.duration_s", duration_s)
    for key, value in keys.items():
        found = found.replace(key.replace("__", "."), value)
    return found


class Ground:
    """Commands a `Core` and keeps all packets that it sends, as (name, time_s, {name: value})."""

    def __init__(self, core: Core):
        software = core.software
        self.core, self.uplink = core, Uplink(software.dictionary)
        self.dictionary, self.link = software.dictionary, software.link
        self.stream = Stream(software.dictionary, "down")
        keys = software.keys
        self.sender = CommandSender(keys.up, keys.spi, keys.spacecraft)
        self.recovery = CommandSender(keys.recovery, keys.recovery_spi, keys.spacecraft)
        self.receiver = TelemetryReceiver({keys.spi: keys.down}, keys.spacecraft)
        self.packets, self.sent = [], []

    def frame(self, name, *values, time_s=0, acknowledge=1, **marks):
        """The bytes of a command; `marks`: request, valid_until."""
        frame = self.uplink.frame(name, time_s, (acknowledge, *values), **marks)
        return self.wrapped(frame, self.recovery if name == "change_key" else self.sender)

    def wrapped(self, data, sender=None):
        """Bytes as the link takes them."""
        return data if self.link == "historical" else (sender or self.sender).wrap(data)

    def use_key(self, number):
        """Command by another key from now on."""
        self.sender.key = self.core.software.keys.command_key(number)
        self.sender.counter = 0

    def tick(self, uplink=b"", times=1):
        """Control steps, the first with an uplink; the packets that came down."""
        found = []
        for _ in range(times):
            sent = self.core.tick(uplink)
            uplink = b""
            if sent is None:
                break
            self.sent.append(sent)
            found += self.decoded(sent)
        self.packets += found
        return found

    def decoded(self, sent):
        """Packets of the bytes of a control step."""
        parts = [sent] if self.link == "historical" else self.receiver.feed(sent)
        return [
            (f.packet.name, f.time_s, dict(zip(f.packet.names, f.values, strict=True)))
            for part in parts
            for f in self.stream.feed(part)
        ]

    def command(self, name, *values, times=4, **keys):
        """Send a command and fly on; its acknowledgement, None if there is none."""
        number = self.dictionary.up[name].id
        found = self.tick(self.frame(name, *values, **keys), times)
        answers = [v for n, _, v in found if n == "acknowledgement" and v["command_id"] == number]
        return answers[-1] if answers else None

    def named(self, name):
        """Values of all packets of a name."""
        return [values for n, _, values in self.packets if n == name]


def flying(duration_s=600.0, software=None, memory=None, **keys):
    """A ground and its satellite."""
    return Ground(Core(scenario(duration_s, **keys), software, memory))


def flown(made, software=None, until=5):
    """A satellite that has flown so many control steps, and a snapshot."""
    core = Core(made, software)
    for _ in range(until):
        core.tick()
    return core, core.snapshot()


def grounded(core, snapshot):
    """A ground that begins to listen to a satellite as it was, which nobody had commanded."""
    core.restore(snapshot)
    return Ground(core)
