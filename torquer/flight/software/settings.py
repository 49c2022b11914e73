"""Settings of modules in the non-volatile memory."""

from __future__ import annotations

from torquer.base.spec import Spec


def settings_file(module: str) -> str:
    """Name of the file in the non-volatile memory that holds a module's settings."""
    return f"settings.{module}"


def save(settings: Spec) -> bytes:
    """Settings as the memory keeps them: JSON."""
    return settings.model_dump_json().encode()


def restore(data: bytes, defaults: Spec) -> Spec | None:
    """Settings that `saved` gave, of the same kind as the defaults; None for anything else."""
    try:
        return type(defaults).model_validate_json(data)
    except ValueError:
        return None
