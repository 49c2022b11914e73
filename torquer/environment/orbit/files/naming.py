"""What tells a file, and the satellites in it, from others: its first line, their names."""


def first_line(text: str, comments: tuple[str, ...] = ()) -> str:
    """The first line that holds something and does not begin as comments do, without blanks."""
    lines = map(str.strip, text.splitlines())
    return next((line for line in lines if line and not line.startswith(comments)), "")


def is_called(wanted: str | None, *names: str) -> bool:
    """Whether a satellite is wanted: by one of its names, in any case of letters; None is any."""
    return wanted is None or _plain(wanted) in map(_plain, names)


def _plain(name: str) -> str:
    """A name, or a catalogue number without zeros before it."""
    word = name.strip().upper()
    return (word.lstrip("0") or "0") if word.isdecimal() else word
