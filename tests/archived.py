"""An archive without a thread: what the ground keeps is in it at once."""

from itertools import count
from pathlib import Path

from torquer.ground.archive import Archive, Batch
from torquer.ground.commands import Commands, last_commands
from torquer.ground.spool import Found


class WrittenAtOnce:
    """In place of a `Spool`: everything is archived before it returns."""

    is_behind = is_failing = False

    def __init__(self, path: Path, dictionary):
        self.path, self.archive = path, Archive(path, dictionary)
        counters = dict(self.archive.read("SELECT name, value FROM _counters"))
        self.found = Found(counters, 0, last_commands(self.archive.read))

    def keep(self, key, statement, values):
        self.archive.store(Batch([], others={key: (statement, values)}))

    def kept(self, *first):
        return []

    def add_counters(self, counters):
        self.archive.store(Batch([], counters))

    def flush(self):
        pass


def commands_on(archive: Archive, dictionary, names) -> Commands:
    """The commands of an archive."""
    ((last,),) = archive.read("SELECT max(id) FROM _commands")

    def keep(command):
        archive.store(Batch([], commands=[command]))

    commands = Commands(dictionary, names, keep, count((last or 0) + 1).__next__)
    commands.adopt(last_commands(archive.read))
    return commands
