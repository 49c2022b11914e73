"""Keys of files, described: what each one is, its unit, range and default.

The description of a key is the text below its field in the spec. It is read from the source on
demand, never during a run.
"""

import inspect
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from torquer.base.field_texts import texts_below_fields
from torquer.base.validate import RANGES, quantity_range
from torquer.scenario.described import Key, Table

#: Units by how a key ends; the longest ending counts, as in `torquer.base.validate.RANGES`.
UNITS = {
    "deg": "deg", "deg_s": "deg/s", "deg_s2": "deg/s²", "deg_s_sqrt_s": "deg/s/√s",
    "deg_sqrt_s": "deg/√s", "deg_h": "deg/h", "deg_h_sqrt_h": "deg/h/√h", "deg_sqrt_h": "deg/√h",
    "arcsec": "arcsec", "rad_s": "rad/s", "rpm": "rpm", "s": "s", "per_s": "1/s",
    "kg_m2": "kg m²", "kg": "kg", "kg_m3": "kg/m³", "m": "m", "m2": "m²", "km": "km",
    "km_s": "km/s", "n_m": "N m", "n_m_s": "N m s", "n_m_sqrt_s": "N m √s", "a_m2": "A m²",
    "m3": "m³", "a_m": "A/m",
    "t": "T", "nt": "nT", "nt_s": "nT/s", "nt_per_a_m2": "nT/(A m²)", "t_km3": "T km³", "w": "W",
    "a": "A", "ohm": "ohm", "ppm": "ppm", "h": "h", "days": "days",
    "a_m2_s": "A m² s", "a_m2_s_per_t": "A m² s/T", "a_m2_per_t": "A m²/T",
    "a_m2_per_n_m_s_t": "A m²/(N m s T)", "n_m_s_per_t2": "N m s/T²", "n_m_per_t2": "N m/T²",
    "a_m2_per_n_m_s": "A m²/(N m s)",
}  # fmt: skip
#: Keys whose name does not state their unit.
_UNITS_OF_KEYS = {"b0": "T", "held_at_year": "year", "viscous_friction_n_m_s": "N m s"}
#: What pydantic calls the bounds of a number.
_BOUNDS = {"gt": "> {}", "ge": "≥ {}", "lt": "< {}", "le": "≤ {}"}


def key_unit(key: str) -> str:
    """Unit of what a key holds, "" for a pure number."""
    if key in _UNITS_OF_KEYS:
        return _UNITS_OF_KEYS[key]
    return UNITS.get(_key_ending(key), "")


def key_words(key: str) -> str:
    """A key in words, without its unit."""
    return key.removesuffix(f"_{_key_ending(key)}").replace("_", " ")


def _key_ending(key: str) -> str:
    """The end of a key that names its unit, "" if none does."""
    return max((each for each in UNITS if f"_{key}".endswith(f"_{each}")), key=len, default="")


def spec_keys(spec: type[BaseModel]) -> list[Key]:
    """The keys of a spec, `kind` first, the rest in the order of its fields."""
    fields = sorted(spec.model_fields.items(), key=lambda field: field[0] != "kind")
    return [
        Key(
            name,
            key_description(spec, name),
            key_unit(name) if _holds(field.annotation, float) else "",
            _values(name, field),
            "" if name == "kind" else _default(field),
        )
        for name, field in fields
    ]


def key_description(spec: type[BaseModel], key: str) -> str:
    """The text below the field of a key, in the spec or the one that it inherits the key from."""
    found = texts_below_fields(spec).get(key, "")
    return f"Selects this variant: {first_sentence(spec)}" if key == "kind" and not found else found


def first_sentence(spec: type[BaseModel]) -> str:
    """First paragraph of a spec's docstring, on one line."""
    return (inspect.getdoc(spec) or "").partition("\n\n")[0].replace("\n", " ")


def _parts(annotation) -> Iterator[Any]:
    """A type and all types within it."""
    yield annotation
    for part in get_args(annotation):
        yield from _parts(part)


def _holds(annotation, *kinds: type) -> bool:
    return any(part is kind for part in _parts(annotation) for kind in kinds)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return ""
    value = field.get_default(call_default_factory=True)
    if isinstance(value, BaseModel):
        kind = getattr(value, "kind", None)
        return f"kind = {toml_value(kind)}" if kind else "the defaults of its keys"
    if isinstance(value, dict):
        return ", ".join(value) if value else "none"
    return "none" if value is None or value == () else toml_value(value)


def toml_value(value) -> str:
    """A default as it would be written in a file."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _values(key: str, field: FieldInfo) -> str:
    """What a key may hold, in words: kinds and bounds."""
    kinds = list(dict.fromkeys(_kinds(field.annotation)))
    if not _holds(field.annotation, float, int):
        return " or ".join(kinds)
    bounds = [
        text.format(f"{getattr(each, name):g}")
        for each in _metadata(field)
        for name, text in _BOUNDS.items()
        if getattr(each, name, None) is not None
    ]
    bounds = list(dict.fromkeys([*bounds, *_range(key, field, bounds)]))
    return ", ".join([" or ".join(kinds), *bounds])


def _metadata(field: FieldInfo) -> list:
    """What may bound numbers: metadata of a field, and of the types within its own."""
    found = [*field.metadata]
    for part in _parts(field.annotation):
        for extra in getattr(part, "__metadata__", ()):
            found += getattr(extra, "metadata", [extra])
    return found


def key_bounds(field: FieldInfo) -> tuple[float | None, float | None]:
    """Least and greatest value of a number or of the numbers of a list; None: no bound."""

    def of(*names: str) -> list[float]:
        given = (getattr(each, name, None) for each in _metadata(field) for name in names)
        return [float(value) for value in given if value is not None]

    return max(of("gt", "ge"), default=None), min(of("lt", "le"), default=None)


def _range(key: str, field: FieldInfo, bounds: list[str]) -> list[str]:
    """The greatest size that the quantity of a key may have, where the key has no bound itself."""
    if any("≤" in bound or "<" in bound for bound in bounds) or not _holds(field.annotation, float):
        return []
    greatest = quantity_range(key).greatest
    if greatest >= RANGES["km"].greatest:
        return []
    return [f"≤ {greatest:g}" if bounds else f"within ±{greatest:g}"]


def _kinds(annotation) -> Iterator[str]:
    """What a type holds, in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation is type(None):
        return
    if origin is Annotated:
        yield from _kinds(inner[0])
    elif origin in (Union, types.UnionType):
        tables = [part for part in inner if _is_spec(part)]
        if len(tables) > 1:
            yield "a table by its kind"
            return
        for part in inner:
            yield from _kinds(part)
    elif origin is Literal:
        yield " | ".join(map(toml_value, inner))
    elif origin is tuple:
        yield _list_in_words(inner)
    elif origin is list:
        yield _list_in_words((*inner, ...))
    elif origin is dict:
        yield "a table by names"
    else:
        yield _one_in_words(annotation)


def _list_in_words(inner) -> str:
    many = " or ".join(dict.fromkeys(map(_many, _kinds(inner[0]))))
    return f"a list of {many}" if inner[-1] is Ellipsis else f"a list of {len(inner)} {many}"


def _many(what: str) -> str:
    """What a list holds, in words, of what one member is."""
    if what.startswith("a list"):
        return what.replace("a list", "lists", 1)
    return {
        "a number": "numbers", "a whole number": "whole numbers", "text": "texts",
        "a table": "tables", "a table by its kind": "tables by their kind",
    }.get(what, f"({what})")  # fmt: skip


def _one_in_words(kind) -> str:
    if _is_spec(kind):
        return "a table"
    names = {
        float: "a number", int: "a whole number", bool: "true | false", str: "text",
        Any: "any value",
    }  # fmt: skip
    return names.get(kind, {"datetime": "a time", "Path": "a path"}.get(kind.__name__, "a value"))


def _is_spec(kind) -> bool:
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    return isinstance(kind, type) and issubclass(kind, BaseModel)


# ------------------------------------------------------------------ all tables of a file


def spec_tables(spec: type[BaseModel], place: str = "") -> list[Table]:
    """All tables below a spec that stands at a place, each once, with the places where it may be.

    Names of the author's choice are NAME, elements of lists [].
    """
    return [
        Table(places, _only_kind(each), inspect.getdoc(each) or "", spec_keys(each))
        for each, places in specs_below(spec, place).items()
    ]


def specs_below(spec: type[BaseModel], place: str = "") -> dict[type[BaseModel], list[str]]:
    """All specs below one that stands at a place, with the places where they may stand."""
    found: dict[type[BaseModel], list[str]] = {}
    _gather(spec, place, (), found)
    return found


def _only_kind(spec: type[BaseModel]) -> str:
    """The only kind of a spec, "" for one without or with a choice of kinds."""
    field = spec.model_fields.get("kind")
    kinds = get_args(field.annotation) if field else ()
    return kinds[0] if len(kinds) == 1 else ""


def _gather(spec, place: str, above: tuple, found: dict) -> None:
    if spec in above:  # a variation may hold a variation
        return
    places = found.setdefault(spec, [])
    if place not in places:
        places.append(place)
    for name, field in spec.model_fields.items():
        for step, inner in _specs_in(field.annotation):
            where = ".".join(part for part in (place, name) if part) + step
            _gather(inner, where, (*above, spec), found)


def _specs_in(annotation, step: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Specs within a type, each with what stands between them and the key."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield step, annotation
        return
    step += {tuple: "[]", dict: ".NAME"}.get(get_origin(annotation), "")
    for part in get_args(annotation):
        if part is not Ellipsis:
            yield from _specs_in(part, step)


def describe(schema: dict, spec: type[BaseModel]) -> None:
    """Add to a JSON schema of a spec the description and unit of every key in it."""
    for each in specs_below(spec):
        table = schema if each is spec else schema["$defs"][each.__name__]
        for key in spec_keys(each):
            unit = f" [{key.unit}]" if key.unit else ""
            table["properties"][key.name]["description"] = key.description + unit
