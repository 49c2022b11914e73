"""The one rule of spans that are asked of an archive: none ends before it begins."""

from __future__ import annotations

from typing import Protocol, TypeVar


class _HasEnds(Protocol):
    """Whatever has a start and an end, in one unit; None: open."""

    @property
    def start(self) -> float | None: ...

    @property
    def end(self) -> float | None: ...


S = TypeVar("S", bound=_HasEnds)


def refuse_reversed(spec: S) -> S:
    """The spec, where its span is one: a validator. ValueError names `end`.

    A span that is reversed holds nothing: an empty answer would be taken for silence.
    """
    if spec.start is not None and spec.end is not None and spec.start > spec.end:
        raise ValueError(f"end: must not be before start; received {spec.end:.17g}")
    return spec
