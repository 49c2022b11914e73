"""Dates and field models as users write them, for all questions about the field."""

import re
from datetime import UTC, date, datetime
from pathlib import Path

from torquer.base.limits import RequestError
from torquer.base.text_files import limited_text
from torquer.base.time import parse_utc
from torquer.base.user_code import OwnFile
from torquer.environment.field import FIELDS
from torquer.environment.field.coefficients import check_date, max_degree
from torquer.environment.field.drift import coefficients_name
from torquer.environment.field.gauss import Gauss


def moment(text: str, key: str = "date") -> datetime:
    """UTC of a date (at 00:00), a time with a zone, or a decimal year; `key`: where it stands."""
    try:
        instant = _moment(text)
        if 1900 <= instant.year < 2100:
            return instant
    except (ValueError, OverflowError):
        pass
    raise RequestError(
        key,
        "must be a date (2025-07-01), a time with a zone (2025-07-01T12:00Z) or a "
        f"decimal year (2025.5), within 1900 to 2099; received {text!r}",
    )


def _moment(text: str) -> datetime:
    if re.fullmatch(r"\d{4}(\.\d*)?", text):
        year = int(text[:4])
        begin, end = (datetime(y, 1, 1, tzinfo=UTC) for y in (year, year + 1))
        return begin + (end - begin) * (float(text) - year)
    try:
        day = date.fromisoformat(text)
    except ValueError:
        return parse_utc(text)
    return datetime(day.year, day.month, day.day, tzinfo=UTC)


def file_text(path: Path, key: str) -> str:
    """The text of a file that a request names."""
    try:
        return limited_text(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        must = f"must be a readable file; received {path} ({reason})"
        raise RequestError(key, must) from None


#: Models that a name says all of.
NAMED = {name: model for name, model in FIELDS.items() if not issubclass(model, OwnFile)}


def stamp(utc: datetime) -> str:
    """A date and time as text."""
    return f"{utc:%Y-%m-%d %H:%M} UTC"


def find_model(text: str, degree: int | None = None):
    """The field model of `name` or `name:degree`."""
    name, _, digits = text.partition(":")
    if name not in NAMED:
        raise RequestError("model", f"must be one of {', '.join(NAMED)}; received {name!r}")
    if digits or text.endswith(":"):
        if not re.fullmatch(r"\d{1,4}", digits):
            must = f"must end with a degree, as in igrf14:6; received {text!r}"
            raise RequestError("model", must)
        degree = int(digits)
    if degree is None:
        return NAMED[name]()
    if not issubclass(NAMED[name], Gauss):
        raise RequestError("degree", f"must go with igrf14 or wmm2025; received it with {name}")
    if not 1 <= degree <= max_degree(name):
        raise RequestError(
            "degree", f"must lie within 1..{max_degree(name)} for {name}; received {degree}"
        )
    return NAMED[name](degree=degree)


def model_at_points(text: str, degree: int | None, extrapolate: bool = False):
    """A model that has values at places, to be used beyond its validity if so asked."""
    model = find_model(text, degree)
    if extrapolate:
        if "extrapolate" not in type(model).model_fields:
            raise RequestError(
                "extrapolate",
                f"must go with a model that has dates; received it with {model.kind}",
            )
        model = model.model_copy(update={"extrapolate": True})
    if not hasattr(model, "b_earth_fixed"):
        others = ", ".join(k for k, v in NAMED.items() if hasattr(v, "b_earth_fixed"))
        raise RequestError(
            "model", f"{model.kind} is defined along an orbit only; must be one of {others}"
        )
    return model


def check_years(model, *years: float, hint: str = "") -> None:
    """RequestError for dates beyond a model's validity; one that extrapolates says so itself."""
    source = coefficients_name(model)
    if source is None or model.extrapolate:
        return
    for year in years:
        try:
            check_date(source, year, False)
        except ValueError as error:
            raise RequestError("date", f"{error}{hint}") from None


def label(model) -> str:
    """A model's name in tables and pictures, marked where it is not the plain model."""
    if getattr(model, "extrapolate", False):
        model = model.model_copy(update={"extrapolate": False})
    if model.kind in NAMED and model == NAMED[model.kind]():
        return model.kind
    if isinstance(model, Gauss) and model == FIELDS[model.kind](degree=model.degree):
        whole = model.degree == max_degree(model.kind)
        return model.kind if whole else f"{model.kind}:{model.degree}"
    return f"{model.kind} (scenario)"
