"""Archives of Chibis-M whose rows are stated one by one, for tests of history."""

from contextlib import closing

from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground.archive import Archive, Row

CHIBIS = load_dictionary("chibis_m")


def row(packet, time_ms, received_ms=None, quality=2, digest=0, **values):
    """A row; numbers that are not given were not known."""
    names = CHIBIS.down[packet].names
    assert set(values) <= set(names)
    known = tuple(values.get(name) for name in names)
    return Row(packet, time_ms, received_ms, quality, 0, digest, known)


def archive_of(path, rows):
    """The path of an archive with rows."""
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put(rows)
    return path
