"""How much memory of Python and NumPy a call takes."""

import tracemalloc


def peak_of(function) -> int:
    """The most that is held at once while a function runs [byte]."""
    tracemalloc.start()
    try:
        function()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
