"""Texts packed for HTML pages, unpacked as a browser would."""

import base64
import gzip


def unpacked(text: str) -> str:
    """The text of a packed script."""
    return gzip.decompress(base64.b64decode(text)).decode("utf-8")
