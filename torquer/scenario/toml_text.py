"""Plain data as TOML text."""

import json


def toml_of(data: dict, place: tuple[str, ...] = ()) -> str:
    """A scenario's plain data as TOML text: plain keys first, then tables."""
    plain = {k: v for k, v in data.items() if not isinstance(v, dict) and v is not None}
    lines = [f"{_key(key)} = {_toml_value(value)}" for key, value in plain.items()]
    if place and (lines or not data):
        lines.insert(0, f"[{'.'.join(map(_key, place))}]")
    blocks = ["\n".join(lines)] if lines else []
    blocks += [toml_of(v, (*place, k)) for k, v in data.items() if isinstance(v, dict)]
    return "\n\n".join(blocks)


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else json.dumps(name)


def _toml_value(value) -> str:
    if isinstance(value, list):
        parts = [_toml_value(item) for item in value]
        if sum(map(len, parts)) < 80:
            return f"[{', '.join(parts)}]"
        return "[\n" + "".join(f"  {part},\n" for part in parts) + "]"
    # JSON writes text, numbers and truth values as TOML does, all but DEL in text
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
