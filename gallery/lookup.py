"""Where the entries are: one file each in `entries/`, found by listing the folder."""

import importlib
import pkgutil
from collections.abc import Iterable

from gallery import entries as _folder
from gallery.catalogue import ROW_OF, known_id
from gallery.entry import Entry


def all_entries() -> list[Entry]:
    """Every entry, in the order of the catalogue; an id served twice is a `ValueError`."""
    names = [module.name for module in pkgutil.iter_modules(_folder.__path__)]
    found = [importlib.import_module(f"{_folder.__name__}.{name}").ENTRY for name in names]
    served = [id_ for entry in found for id_ in entry.ids]
    if twice := sorted({id_ for id_ in served if served.count(id_) > 1}):
        raise ValueError(f"gallery: an id must have one entry; received two for {', '.join(twice)}")
    order = list(ROW_OF)
    return sorted(found, key=lambda entry: order.index(entry.id))


def entry_of() -> dict[str, Entry]:
    """The entry of every id that has one, in the order of the catalogue."""
    by_id = {id_: entry for entry in all_entries() for id_ in entry.ids}
    return {id_: by_id[id_] for id_ in ROW_OF if id_ in by_id}


def wanted(ids: Iterable[str]) -> list[Entry]:
    """The entries of these ids, each once; `ValueError` for an id unknown or not yet done."""
    done = entry_of()
    chosen = {}
    for id_ in map(known_id, ids):
        if id_ not in done:
            raise ValueError(
                f"gallery: must be an entry that is done; received {id_}, which is not yet; "
                "see: gallery list"
            )
        chosen[done[id_].id] = done[id_]
    return list(chosen.values())
