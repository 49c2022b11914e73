"""File systems of the flight software's memory that refuse, and files that are lost or damaged."""

PLACES = ("main", "reserve")


class Full(dict):
    """A file system that takes no more files."""

    def __setitem__(self, name, content):
        raise OSError(28, "No space left on device")


class ReadOnly(Full):
    """One that does not let any go either."""

    def __delitem__(self, name):
        raise OSError(30, "Read-only file system")


def spoil(memory, how, name, places=PLACES):
    """A file is 'lost', 'damaged' or 'torn'; or a file system is one of the kinds above."""
    files = memory.places
    for place in places:
        if how == "lost":
            files[place].pop(name)
        elif how == "damaged":
            files[place][name] = files[place][name][:-1] + bytes([files[place][name][-1] ^ 1])
        elif how == "torn":
            files[place][name] = files[place][name][:-3]
        else:
            files[place] = how(files[place])
