"""Command and data handler: the bounded queues by which modules exchange data.

According to SDOT 3.4, a full queue drops its oldest element, and the sender of an element to a full
queue gets an error; the queues here do both.
"""

from collections import deque
from collections.abc import Mapping
from typing import Any

#: Least and greatest number of elements that a queue may hold.
SIZES = (3, 10)


class Cdh:
    """Queues by name, each of 3 to 10 elements; plain state that can be copied.

    `dropped` counts by queue the elements that were lost to overflow.
    """

    def __init__(self, sizes: Mapping[str, int]):
        """`sizes`: greatest number of elements by queue; `ValueError` unless from 3 to 10."""
        for name, size in sizes.items():
            if not SIZES[0] <= size <= SIZES[1]:
                raise ValueError(f"{name}: a queue must hold 3 to 10 elements; received {size}")
        self.queues: dict[str, deque] = {name: deque(maxlen=n) for name, n in sizes.items()}
        self.dropped = dict.fromkeys(sizes, 0)
        self._last_dropped: dict[str, Any] = {}

    def put(self, queue: str, item: Any) -> bool:
        """Append an element; False if the queue was full and its oldest element was dropped."""
        elements, is_full = self.queues[queue], self.is_full(queue)
        if is_full:
            self._last_dropped[queue] = elements[0]
            self.dropped[queue] += 1
        elements.append(item)
        return not is_full

    def is_full(self, queue: str) -> bool:
        """Whether a further element would drop the oldest."""
        elements = self.queues[queue]
        return len(elements) == elements.maxlen

    def take_dropped(self, queue: str) -> Any:
        """The element that the last overflow dropped, once; else None."""
        return self._last_dropped.pop(queue, None)

    def take(self, queue: str) -> Any:
        """Remove and return the oldest element; None from an empty queue."""
        elements = self.queues[queue]
        return elements.popleft() if elements else None

    def newest(self, queue: str) -> Any:
        """The newest element, which stays in the queue; None from an empty queue."""
        elements = self.queues[queue]
        return elements[-1] if elements else None
