"""Keys of commands on board, and what the non-volatile memory keeps of them: fail closed.

    counters.up        number of the key of commands, its counter, counter of the recovery key
    counter.recovery   number of the key of commands, counter of the recovery key

A counter is stored before the command acts: if power fails in between, the command is lost, and the
ground, without an answer, sends it again; it cannot be executed twice. One that cannot be stored is
a command that is not executed, and closes the key of commands. A key whose counter is lost is
closed: frames that were recorded earlier would be accepted. The recovery key then gives commands a
new one, with a number above all that there were, so that no frame was ever made with it. Each file
has what the recovery key needs, so that this key is closed, for good, only without either.
"""

import struct

from torquer.flight.packets.keys import Keys
from torquer.flight.packets.protected import CommandReceiver
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.security import USED_UP
from torquer.flight.software.memory import Memory

COMMANDS, RECOVERY = "counters.up", "counter.recovery"
#: How far a counter and the number of a key may leap: one mistake does not use them up.
WINDOW = 10000
_COMMANDS, _RECOVERY = struct.Struct("<III"), struct.Struct("<II")


def deliver_keys(memory: Memory) -> None:
    """The counters of an empty memory as it is delivered: without them it has lost them."""
    memory.write(COMMANDS, _COMMANDS.pack(0, 0, 0))
    memory.write(RECOVERY, _RECOVERY.pack(0, 0))


class CommandKeys:
    """The receiver of commands with the counters that the memory has; plain state.

    `number`: of the key of commands; `closed`: indices of the keys that accept nothing; `events`:
    what is to be reported, reason and index, until it is taken.
    """

    def __init__(self, keys: Keys, memory: Memory):
        self._keys = keys
        commands = _read(memory, COMMANDS, _COMMANDS)
        recovery = _read(memory, RECOVERY, _RECOVERY)
        known = [each for each in (commands[::2], recovery) if each]
        self.number = max((number for number, _ in known), default=0)
        self.receiver = CommandReceiver(
            {keys.spi: keys.command_key(self.number), keys.recovery_spi: keys.recovery},
            keys.spacecraft,
            WINDOW,
            {
                keys.spi: commands[1] if commands[:1] == (self.number,) else USED_UP,
                keys.recovery_spi: max((last for _, last in known), default=USED_UP),
            },
        )
        self.events = [(Reason.KEY_CLOSED, spi) for spi in self.closed]
        if len(known) < 2 or self.closed:
            self._keep_recovery(memory)
            self._keep_commands(memory)

    @property
    def closed(self) -> list[int]:
        return [spi for spi, last in self.receiver.counters.items() if last == USED_UP]

    def take(self, data: bytes, memory: Memory, ended: bool = False) -> list[tuple[int, bytes]]:
        """Index of the key and content of the frames that are accepted and whose counter is kept.

        `ended`: no more bytes follow.
        """
        receiver, refused = self.receiver, self.receiver.rejected["closed"]
        frames = receiver.take(data, ended)
        if receiver.rejected["closed"] > refused:
            self.events += [(Reason.KEY_CLOSED, spi) for spi in self.closed]
        if not frames:
            return []
        kept = [spi for spi in {*map(receiver.index_of, frames)} if self._keep(spi, memory)]
        pairs = zip(map(receiver.index_of, frames), receiver.contents(frames), strict=True)
        return [(spi, content) for spi, content in pairs if spi in kept]

    def change(self, number: int, memory: Memory) -> Reason:
        """Commands have the key with this number from now on, whose counter begins at 0."""
        if not self.number < number <= self.number + WINDOW:
            return Reason.VALUE
        spi, before = self._keys.spi, (self.number, self.receiver.counters[self._keys.spi])
        self.number, self.receiver.counters[spi] = number, 0
        # the other way about, a failure in between would leave a new key and its old number
        if not (self._keep_recovery(memory) and self._keep_commands(memory)):
            self.number, self.receiver.counters[spi] = before
            return Reason.FAILED
        self.receiver.keys[spi] = self._keys.command_key(number)
        return Reason.DONE

    def _keep(self, spi: int, memory: Memory) -> bool:
        """Store the counter of a key; that of commands is lost if it cannot be stored."""
        if spi == self._keys.recovery_spi:
            kept = self._keep_recovery(memory)
        elif not (kept := self._keep_commands(memory)):
            self.receiver.counters[spi] = USED_UP
            if memory.read(RECOVERY) is not None:  # which is enough to open it again
                memory.remove(COMMANDS)
        if not kept:
            self.events.append((Reason.COUNTER_NOT_KEPT, spi))
        return kept

    def _keep_commands(self, memory: Memory) -> bool:
        last, recovery = (self.receiver.counters[spi] for spi in self._indices)
        return memory.advance(COMMANDS, _COMMANDS.pack(self.number, last, recovery))

    def _keep_recovery(self, memory: Memory) -> bool:
        recovery = self.receiver.counters[self._keys.recovery_spi]
        return memory.advance(RECOVERY, _RECOVERY.pack(self.number, recovery))

    @property
    def _indices(self) -> tuple[int, int]:
        return self._keys.spi, self._keys.recovery_spi


def _read(memory: Memory, name: str, form: struct.Struct) -> tuple[int, ...]:
    """The numbers in a file; () for one that is lost, damaged or of another length."""
    data = memory.read(name)
    return form.unpack(data) if data is not None and len(data) == form.size else ()
