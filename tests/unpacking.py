"""Texts and arrays packed for pages, unpacked as a browser would."""

import base64
import gzip
import json
import math
import re
import struct

import numpy as np


def unpacked(text: str) -> str:
    """The text of a packed script."""
    return gzip.decompress(base64.b64decode(text)).decode("utf-8")


def unpacked_answer(answer: bytes) -> tuple[dict, dict[str, np.ndarray]]:
    """Header and arrays of an answer of the board."""
    (length,) = struct.unpack_from("<I", answer)
    header, at, arrays = json.loads(answer[4 : 4 + length]), 4 + length, {}
    at += -at % 8
    for name, shape in header["arrays"].items():
        count = math.prod(shape)
        arrays[name] = np.frombuffer(answer, "<f8", count, at).reshape(shape)
        at += 8 * count
    return header, arrays


def figures_on(page: str) -> dict[str, dict]:
    """Plotly figures of a page by the words that describe them."""
    found = re.findall(r'aria-label="([^"]+)"[^>]*><script [^>]*>([^<]+)</script>', page)
    return {words: json.loads(unpacked(text)) for words, text in found}


def numbers(values: dict) -> np.ndarray:
    """Numbers that a trace has packed."""
    return np.frombuffer(base64.b64decode(values["bdata"]), dtype=f"<{values['dtype']}")


def trace(figure: dict, name: str) -> tuple[np.ndarray, np.ndarray]:
    """(x, y) of the first trace with a name that is in the legend."""
    each = next(t for t in figure["data"] if t["name"] == name and t.get("showlegend", True))
    return numbers(each["x"]), numbers(each["y"])
