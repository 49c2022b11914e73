"""Who orders: a name that people state. Nothing proves it."""

#: Header that states it, with percent signs for what is not of ASCII.
OPERATOR = "torquer-operator"
_LONGEST = 40


def fault_of(name: str) -> str:
    """What must hold of a name that is stated, as the end of a message; "" for a good one."""
    if 0 < len(name.strip()) <= _LONGEST and name.isprintable() and "\ufffd" not in name:
        return ""
    return f"must be 1 to {_LONGEST} printable characters; received {name[:100]!a}"
