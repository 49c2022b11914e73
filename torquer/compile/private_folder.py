"""Whether code that lies in a folder may be executed: nobody else could have put it there."""

import os
import stat


def is_ours(found: os.stat_result) -> bool:
    """Whether something belongs to this user or to the administrator."""
    return found.st_uid in (os.getuid(), 0)


def is_private(found: os.stat_result) -> bool:
    """Whether something is ours, and nobody else can write there."""
    if not hasattr(os, "getuid"):  # Windows keeps users apart by itself
        return True
    return is_ours(found) and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
