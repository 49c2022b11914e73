"""Specs as their keys in scenario files, in one line: not as the numbers that kernels take."""

import json
from collections.abc import Mapping

import numpy as np

#: Most numbers of a list that are shown one by one.
_MOST_NUMBERS = 12


def changed_keys(spec) -> dict:
    """Keys of a spec that are given and differ from their defaults, without its kind."""
    given = json.loads(spec.model_dump_json(exclude_defaults=True, exclude_none=True))
    return {key: value for key, value in given.items() if key != "kind"}


def in_one_line(values: Mapping) -> str:
    """Keys with their values as in a scenario file; of long lists, their sizes."""
    return ", ".join(f"{key} = {value_in_words(value)}" for key, value in values.items())


def value_in_words(value) -> str:
    """A value as in a scenario file; of a long list, its size."""
    if isinstance(value, dict):
        return f"{{ {in_one_line(value)} }}"
    if isinstance(value, list | tuple):
        size = _size(value)
        if int(np.prod(size or (1,))) > _MOST_NUMBERS:
            return f"{' x '.join(map(str, size))} numbers"
        return f"[{', '.join(map(value_in_words, value))}]"
    if isinstance(value, float):
        return f"{value:g}"
    return json.dumps(value, ensure_ascii=False)


def _size(value) -> tuple[int, ...]:
    """Shape of nested lists of numbers; () for what is no such list."""
    try:
        shown = np.array(value)
    except ValueError:  # rows of different lengths
        return ()
    return shown.shape if shown.dtype.kind in "biuf" else ()
