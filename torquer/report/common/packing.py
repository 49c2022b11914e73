"""Texts packed for HTML pages: compressed, as base64; the browser unpacks them itself."""

import base64
import zlib

#: gzip's format, which every browser since 2023 unpacks (`DecompressionStream`).
_GZIP = 16 + zlib.MAX_WBITS
#: Type of a script that holds a packed text.
PACKED = "application/gzip"


def pack_text(text: str, level: int = 4) -> str:
    """The text, compressed, as base64."""
    packer = zlib.compressobj(level, zlib.DEFLATED, _GZIP)
    data = packer.compress(text.encode("utf-8")) + packer.flush()
    return base64.b64encode(data).decode("ascii")
