"""Files of text are read up to a size, and their keys checked, before any parser sees them.

Python's TOML parser takes memory with the square of the parts of a dotted key. Nothing of the
package is imported here: commands ask before they load anything that takes time.
"""

import re
from pathlib import Path

#: Bytes of the largest file: a campaign with a hundred thousand values has two million.
MOST_BYTES = 4_000_000
#: More levels of tables and lists than any scenario needs.
LEVELS = 32
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{{LEVELS}}}")


def limited_text(path: Path) -> str:
    """The text of a file; ValueError for one that is too long, OSError if it cannot be read."""
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"more than {MOST_BYTES // 1_000_000} MB")
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise ValueError("not UTF-8 text") from None


def has_deep_key(text: str) -> bool:
    """Whether a dotted key of a TOML text has more parts than there may be levels."""
    return _DEEP_KEY.search(text) is not None
