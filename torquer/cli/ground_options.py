"""What options of the commands of `torquer ground` share."""

from datetime import datetime
from pathlib import Path

#: Where archives are unless another folder is given.
FOLDER = Path("runs/ground")


def date_ms(option: str, text: str | None) -> int | None:
    """Milliseconds since 1970 of a date with a zone; ValueError for anything else."""
    if text is None:
        return None
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        at = None
    if at is None or at.tzinfo is None:
        raise ValueError(
            f"{option}: must be a time with a zone, such as 2012-01-01T00:00:00Z; received {text}"
        )
    return round(at.timestamp() * 1e3)
