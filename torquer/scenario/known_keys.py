"""Which keys a table of a file may have, and which of them a mistyped one may mean."""

import difflib
import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

#: More known keys than these are not listed.
_MOST_LISTED = 30


def known_keys(spec: type[BaseModel], loc: tuple) -> list[str]:
    """Keys of the table at a place, as pydantic names it (with kinds and members of unions)."""
    at: list[Any] = [spec]
    for part in loc:
        at = [inner for each in at for inner in _within(each, part)]
    tables = {each: None for each in at if _is_table(each)}  # in order, each once
    return list(dict.fromkeys(key for table in tables for key in table.model_fields))


def spec_named(name: str) -> type[BaseModel] | None:
    """The spec whose mistakes pydantic reports by this name."""
    from torquer.base.spec import Spec

    to_see: list[type[BaseModel]] = [Spec]
    while to_see:
        found = to_see.pop()
        if found.__name__ == name:
            return found
        to_see += found.__subclasses__()
    return None


def suggestion(key: str, known: list[str]) -> str:
    """In brackets, for the end of a message: a known key near this one, or all known keys."""
    begin = [each for each in known if each.startswith(f"{key.rstrip('s')}_")]
    near = difflib.get_close_matches(key, known, 1, 0.65) or (begin if len(begin) == 1 else [])
    if near:
        return f" (did you mean {near[0]}?)"
    if not known or len(known) > _MOST_LISTED:
        return ""
    return f" (known: {', '.join(known)})"


def _is_table(annotation) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _members(annotation) -> list:
    """The types that a value may have, without their annotations."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _members(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return [member for each in get_args(annotation) for member in _members(each)]
    return [annotation]


def _kinds(spec) -> tuple:
    field = spec.model_fields.get("kind")
    return get_args(field.annotation) if field and get_origin(field.annotation) is Literal else ()


def _within(annotation, part) -> list:
    """Types of what stands at a part of a place; of all members of a union that can have it."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if _is_table(annotation):
        if part in annotation.model_fields:
            return _members(annotation.model_fields[part].annotation)
        # a kind, or pydantic's name for the member of a union that was tried: it stays
        return [annotation] if part in _kinds(annotation) or _names(annotation, part) else []
    if isinstance(part, int) and origin in (tuple, list):
        return [member for each in inner if each is not Ellipsis for member in _members(each)]
    if isinstance(part, str) and isinstance(origin, type) and issubclass(origin, dict):
        return _members(inner[1])
    return [annotation] if isinstance(part, str) and "[" in part else []


def _names(spec, part) -> bool:
    return isinstance(part, str) and spec.__name__ in part
