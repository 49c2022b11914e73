"""Why Numba cannot compile a user's function, in the user's words, and what works instead."""

import difflib
import re

from torquer.computer.inputs import Inputs, ReadingTimes
from torquer.computer.interface import Ephemeris, Estimate

#: Names of what plug-ins are handed.
_FIELDS = {each.__name__: each._fields for each in (Inputs, Estimate, Ephemeris, ReadingTimes)}
#: How operators are written, by their names.
_OPERATORS = {
    "add": "+", "iadd": "+=", "sub": "-", "isub": "-=", "neg": "-", "mul": "*", "imul": "*=",
    "truediv": "/", "itruediv": "/=", "matmul": "@", "pow": "**",
}  # fmt: skip
#: What works where arrays, arithmetic of tuples and functions of other libraries do not.
INSTEAD = (
    "vectors are tuples: torquer.maths.geometry.vec3 has add, scale, dot, cross, norm for them"
)
#: Statements and expressions as Numba tells of them, and what to write instead.
_CONSTRUCTS = {
    "The 'with (context manager)": ("a `with` statement", ""),
    "Unsupported context manager": ("a `with` statement", ""),
    "Illegal IR, del found": ("a `del` statement", "; leave it out"),
    "The use of yield in a closure": ("a generator expression", "; write a loop"),
    "Type of variable": ("a value whose type is not known", "; set it in a statement before"),
    "Failed in nopython mode pipeline": ("a value that is no number", ""),
}
_PLAIN_WORDS = {"none": "nothing", "array": "an array"}
#: Characters of a type that a message shows.
_LONGEST_TYPE = 200


def type_in_words(kind: str) -> str:
    """A type as Numba writes it, in words where it is made of numbers: 'tuple of 3 numbers'."""
    text = re.sub(r"\b(float64|u?int\d+|Literal\[int\]\(-?\d+\))", "number", kind)
    text = re.sub(r"Literal\[bool\]\((\w+)\)|\bbool\b", lambda found: found[1] or "truth", text)
    text = re.sub(r"\bcomplex\d+\b", "complex", text)
    text = re.sub(r"<iv=.*?>", "", re.sub(r"Literal\[str\]\(.*?\)|unicode_type", "text", text))
    text = re.sub(r"array\(number, 1d, \w\)", "array", text)
    text = re.sub(r"array\(number, (\d)d, \w\)", r"array of \1 dimensions", text)
    while (tuples := re.sub(r"\bUniTuple\((\w+)([^()]*) x (\d+)\)", _tuple, text)) != text:
        text = tuples
    return text


def _tuple(found: re.Match) -> str:
    word, rest, count = found.groups()
    return f"tuple of {count} {word}s{rest}" if int(count) > 1 else f"tuple of 1 {word}{rest}"


def returned_in_words(kind: str) -> str:
    """What a function returns, by Numba's type; with what works instead of arrays."""
    if "generator(" in kind:
        return "a generator"
    text = type_in_words(kind)
    if len(text) > _LONGEST_TYPE:
        text = f"{text[:_LONGEST_TYPE]}..."
    shown = _PLAIN_WORDS.get(text) or re.sub(r"^(tuple|number)\b", r"a \1", text)
    shown = re.sub(r"^array\b", "an array", shown)
    joined = re.match(r"tuple of (6|9|12) numbers$", text)  # by +, which adds no tuples
    return shown + instead() if joined or text.startswith("array") else shown


def instead(plainly: str = "") -> str:
    """What works, to follow what does not; `plainly`: how the function can run as plain Python."""
    return f"; {INSTEAD}" + (f"; or {plainly}" if plainly else "")


def in_words(reason: str, whole: str, plainly: str) -> tuple[str, str]:
    """Numba's reason in words, and what works instead or ""; `whole`: all that Numba wrote."""
    way_out, alone = instead(plainly), f"; {plainly}" if plainly else ""
    for begins, (construct, what) in _CONSTRUCTS.items():
        if reason.startswith(begins):
            return f"{construct}, which cannot be compiled", what or alone
    if found := re.match(r"Unknown attribute '(\w+)' of type Module\(<module '([\w.]+)'", reason):
        is_numpy = found[2].partition(".")[0] == "numpy"
        return f"{found[2]}.{found[1]}, which cannot be compiled", way_out if is_numpy else alone
    if found := re.match(r"Unknown attribute '(\w+)' of type (\w+)\(", reason):
        name, holder = found.groups()
        near = difflib.get_close_matches(name, _FIELDS.get(holder, ()), 1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        return f"{holder} without a field {name!r}{hint}", way_out if holder == "array" else ""
    if found := re.match(r"Use of unsupported NumPy function '([\w.]+)'", reason):
        return f"{found[1]}, which cannot be compiled", way_out
    if found := re.match(r"Untyped global name '(\w+)'", reason):
        return f"{found[1]}, which cannot be compiled", alone
    if found := re.match(r"Can't unify return type from the following types: (.*)", reason):
        return f"one that returns values of several types: {type_in_words(found[1])}", way_out
    if found := re.match(r"Cannot unify (.*) and (.*) for ", reason):
        a, b = map(type_in_words, found.groups())
        return f"a value that is of several types: {a}, {b}", way_out
    if found := re.match(r"No definition for lowering (\w+)\(.*\)\.(\w+) = ", reason):
        return f"{found[1]}.{found[2]}, which cannot be set", ""
    if reason.startswith("failed to unpack"):
        what = "an unpacked vector or matrix of the memory, which cannot be compiled"
        return what, "; read each number, such as memory.b[0]"
    if reason.startswith("Use of unsupported opcode"):
        return "a statement that cannot be compiled", alone
    if reason.startswith("No implementation of function"):
        return _call_in_words(reason, whole, way_out)
    return reason, ""


def _call_in_words(reason: str, whole: str, way_out: str) -> tuple[str, str]:
    """A call that Numba has no code for, from its line '>>> norm(UniTuple(float64 x 3))'."""
    called = re.search(r">>> (\w+)\((.*)\)\s*$", whole, re.M)
    if not called:
        return reason, way_out
    if called[1] == "exception_match":
        what = "an `except` of one kind of error, which cannot be compiled"
        return what, "; write `except Exception`"
    name, types = called[1], type_in_words(called[2])
    sign = _OPERATORS.get(name) if "<built-in function" in reason else None
    if sign is None:
        return f"{name}({types}), which cannot be compiled", way_out
    left, comma, right = types.partition(", ")
    shown = f"{left} {sign} {right}" if comma else f"{sign}({types})"
    # arithmetic of tuples fails in plain Python, too
    return f"{shown}, which cannot be compiled", instead()
