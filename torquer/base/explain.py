"""Errors that pydantic found in a file or a spec, in the user's terms: key, requirement, value."""

import difflib
import json
import re
import types
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from torquer.base.units import conversion, did_you_mean
from torquer.compile.when_compiling import plainly

#: A type, as pydantic writes it in a place: the member of a union that was tried.
_TYPE = re.compile(r"(function-|(tuple|list|dict|set|union|nullable|constrained)[\w-]*\[)")
#: What must hold, by pydantic's type of error; the rest is taken from pydantic's message.
_MUST = {
    "bool_type": "must be true or false",
    "dict_type": "must be a table of keys",
    "finite_number": "must be finite",
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "int_from_float": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "must be a whole number of 64 bits",
    "int_type": "must be a whole number",
    "model_attributes_type": "must be a table of keys",
    "model_type": "must be a table of keys",
    "path_type": "must be the path of a file",
    "string_pattern_mismatch": (
        "must begin with a letter, digit or '_' and hold only these, '-' and '.'"
    ),
    "string_type": "must be text",
    "tuple_type": "must be a list",
}
#: Errors that state only that a value is of another kind than this member of a union.
_OTHER_KIND = ("float_type", "tuple_type")
#: Characters of the longest value and of the longest line that are shown.
_LONGEST_VALUE, _LONGEST_LINE = 100, 1000
#: More known keys than these are not listed.
_MOST_LISTED = 30
M = TypeVar("M", bound=BaseModel)


class ScenarioError(ValueError):
    """Errors in a file or in the keys of a spec: one line each.

    >>> try:
    ...     scenario.replace("orbit.altitude_km", -1)
    ... except torquer.ScenarioError as error:
    ...     print(error)
    orbit.altitude_km: ...
    """

    def __init__(self, text: str):
        super().__init__("\n".join(map(_shorten, text.split("\n"))))


def _shorten(line: str) -> str:
    """A line without the middle of a value that fills pages."""
    return line if len(line) <= _LONGEST_LINE else f"{line[: _LONGEST_LINE // 2]} ... {line[-100:]}"


def validate_tables(spec: type[M], data: dict) -> M:
    """The spec of a file's tables; `ScenarioError` with one line per mistake.

    What is computed for it is a few numbers, which needs no compiler.
    """
    try:
        with plainly():
            return spec.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(explain(error, data, spec))) from None


def explain(
    error: ValidationError, data: dict, spec: type[BaseModel], whole: str = "scenario"
) -> list[str]:
    """One line per mistake in `data`, the tables of the file; `spec`: what they were to be.

    `whole`: the word for all of it, where no single key is at fault.
    """
    lines: dict[tuple, str] = {}
    for place, mistakes in _by_place(error, data).items():
        chosen = min(mistakes.values(), key=_strangeness)
        for keys, mistake in chosen:
            lines[place, keys] = _line(keys, mistake, spec, whole)
    message = [line for text in lines.values() for line in text.split("\n")]
    return list(dict.fromkeys(message))


def _by_place(error: ValidationError, data: dict) -> dict:
    """Mistakes as {key: {member of the union at that key, or "": [(key, mistake)]}}."""
    found: dict = {}
    for mistake in error.errors():
        if mistake["type"] == "too_short" and len(mistake["input"]) >= mistake["ctx"]["min_length"]:
            continue  # long enough, but its members are wrong, and each has its line
        keys, union, member = _keys(mistake, data)
        if mistake["type"] == "missing" and isinstance(mistake["input"], list | tuple):
            keys = keys[:-1]  # a list that is too short
        place = keys if union is None else union
        found.setdefault(place, {}).setdefault(member, []).append((keys, mistake))
    return found


def _keys(mistake: Any, data) -> tuple[tuple, tuple | None, str]:
    """(keys that stand in the file, keys of the innermost untagged union, its member).

    The loc of pydantic also holds the kind of a tagged union and the type that was tried in an
    untagged one: what is no key of the data at that place, unless it is the last: a missing key.
    """
    loc, is_missing = mistake["loc"], mistake["type"] == "missing"
    keys: tuple = ()
    union, member, skipped = None, "", False
    for i, part in enumerate(loc):
        if isinstance(part, str) and _TYPE.match(part):
            union, member = keys, part
        elif isinstance(data, dict):
            is_kind = not skipped and part == data.get("kind")
            if is_kind or (part not in data and not (is_missing and i + 1 == len(loc))):
                skipped = True  # a table has one kind: the same word again is a key
                continue
            skipped = False
            keys, data = (*keys, part), data.get(part)
        elif isinstance(part, int):
            keys = (*keys, part)
            data = data[part] if isinstance(data, list | tuple) and part < len(data) else None
        else:
            union, member = keys, part
    return keys, union, member


def _strangeness(mistakes: list) -> tuple[int, int]:
    """How far a value is from a member of a union: the nearest one is explained."""
    strange = sum(_is_of_other_kind(mistake) for _, mistake in mistakes)
    return len(mistakes), strange


def _is_of_other_kind(mistake: dict) -> bool:
    is_no_word = mistake["type"] == "literal_error" and not isinstance(mistake["input"], str)
    return is_no_word or mistake["type"] in _OTHER_KIND


def key_name(keys: tuple, whole: str = "scenario") -> str:
    """Keys as the user writes them: `spacecraft.coils.limit_a_m2[1]`; odd ones in quotes."""
    shown = ""
    for key in keys:
        if isinstance(key, int):
            shown += f"[{key}]"
        elif re.fullmatch(r"[\w-]+(\[\d+\])*", key):
            shown += f".{key}"
        else:
            shown += f".{json.dumps(key, ensure_ascii=False)}"
    return shown.removeprefix(".") or whole


def _line(keys: tuple, mistake: dict, spec: type[BaseModel], whole: str) -> str:
    """The error; the package's own check may report several, a line each."""
    key, kind, context = key_name(keys, whole), mistake["type"], mistake.get("ctx", {})
    received = quote(mistake["input"])
    if kind == "value_error":
        return "\n".join(_own_line(keys, line, whole) for line in str(context["error"]).split("\n"))
    if kind == "missing":
        if isinstance(mistake["input"], list | tuple):
            return f"{key}: must have {mistake['loc'][-1] + 1} values; received {received}"
        return f"{key}: must be given; received nothing"
    if kind == "extra_forbidden":
        known = known_keys(spec, mistake["loc"][:-1])
        text = suggestion(str(mistake["loc"][-1]), known)
        return f"{key}: must be a known key; received {received}{text}"
    if kind == "too_short":
        return f"{key}: must have {context['min_length']} or more values; received {received}"
    if kind == "too_long":
        most = "at most " if _varies(spec, mistake["loc"]) else ""
        return f"{key}: must have {most}{context['max_length']} values; received {received}"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        given = mistake["input"].get("kind")
        received = "nothing" if given is None else quote(given)
        known = _kinds_at(spec, mistake["loc"])
        near = difflib.get_close_matches(str(given), known, 1)
        text = f" (did you mean {near[0]}?)" if near else ""
        return f"{key}.kind: must be one of {', '.join(known)}; received {received}{text}"
    must = _MUST.get(kind) or f"must be {mistake['msg'].removeprefix('Input should be ')}"
    return f"{key}: {must}; received {received}"


def _kinds_at(spec: type[BaseModel], loc: tuple) -> list[str]:
    """Kinds that a table may have in a file: what comes from Python alone is not named."""
    tables = [each for each in _types_at(spec, loc) if _is_table(each)]
    in_files = [each for each in tables if getattr(each, "in_files", True)]
    return list(dict.fromkeys(kind for each in in_files for kind in _kinds(each)))


def _varies(spec: type[BaseModel], loc: tuple) -> bool:
    """Whether the lists that a place may hold have no length of their own."""
    lists = [each for each in _types_at(spec, loc) if get_origin(each) in (tuple, list)]
    return bool(lists) and all(get_args(each)[-1] is Ellipsis or get_origin(each) is list
                               for each in lists)  # fmt: skip


def _own_line(keys: tuple, text: str, whole: str) -> str:
    """The line of the package's own check, 'name: what must hold', led by the whole key."""
    name, _, rest = text.partition(": ")
    if not rest:
        return f"{key_name(keys, whole)}: {text}"
    words = name.split()
    if text[:1] in ("[", ":"):  # of the value at the key, or of a part of it
        return f"{key_name(keys, whole)}{text}"
    if words[-1].rpartition(".")[2] in keys:
        return f"{key_name(keys, whole)}: {rest}"
    if len(words) > 1:
        return f"{key_name(keys, whole)}: {text}"
    return f"{key_name((*keys, *_words(name)))}: {rest}"


def _words(name: str) -> list[str]:
    """Words of a dotted key, of which one in quotes may hold dots itself."""
    return [quoted or plain for quoted, plain in re.findall(r'"([^"]*)"|([^."]+)', name)]


def quote(value) -> str:
    """A value as a message shows it."""
    try:
        shown = repr(value)
    except ValueError:  # Python does not write out the longest integers
        return "a number of thousands of digits"
    return shown if len(shown) <= _LONGEST_VALUE else shown[:_LONGEST_VALUE] + "..."


# ------------------------------------------------------------------ known keys


def known_keys(spec: type[BaseModel], loc: tuple) -> list[str]:
    """Keys of the table at a place, as pydantic names it (with kinds and members of unions)."""
    at = _types_at(spec, loc)
    tables = {each: None for each in at if _is_table(each)}  # in order, each once
    return list(dict.fromkeys(key for table in tables for key in table.model_fields))


def _types_at(spec: type[BaseModel], loc: tuple) -> list:
    """Types that a value may have at a place, as pydantic names it."""
    at: list[Any] = [spec]
    for part in loc:
        at = [inner for each in at for inner in _within(each, part)]
    return at


def suggestion(key: str, known: list[str]) -> str:
    """In brackets, for the end of a message: a known key near this one, or all known keys."""
    begin = [each for each in known if each.startswith(f"{key.rstrip('s')}_")]
    if hint := did_you_mean(key, known, 0.65):
        return hint
    if len(begin) == 1 and conversion(key, begin[0]) == "":
        return f" (did you mean {begin[0]}?)"
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
        named = isinstance(part, str) and annotation.__name__ in part
        return [annotation] if named or part in _kinds(annotation) else []
    if isinstance(part, int) and origin in (tuple, list):
        return [member for each in inner if each is not Ellipsis for member in _members(each)]
    if isinstance(part, str) and isinstance(origin, type) and issubclass(origin, dict):
        return _members(inner[1])
    return [annotation] if isinstance(part, str) and "[" in part else []
