"""Texts of the files of an export: `templates/` has them with places for what differs."""

import re
from pathlib import Path
from string import Template

_FOLDER = Path(__file__).parent / "templates"
#: What stands around the kernels, or includes their types.
_AROUND = ("adcs*.[ch]", "in_the_loop.c", "../harness/replay.c")
#: What differs in single precision.
PRECISION = """\
/* Kernels compute in single precision, but for times; interface and memory hold doubles. */

"""
#: Numbers of the self-test: a part of 1 whose square is lost in it, the least number.
_OF_TEST = {
    "double": {"real": "double", "f": "", "part": "0x1p-27", "least": "0x1p-1074"},
    "float": {"real": "float", "f": "f", "part": "0x1p-12", "least": "0x1p-149"},
}


def read_template(file: str) -> str:
    """A file of `templates/` as it is."""
    return (_FOLDER / file).read_text(encoding="utf-8")


def fill_template(file: str, places: dict[str, str]) -> str:
    """A file of `templates/` with its places (`$name`) filled."""
    return Template(read_template(file)).substitute(places)


def self_test(reals: tuple[str, ...]) -> dict[str, str]:
    """Text of what tests numbers of these types in `adcs_self_test`, and how that is called."""
    return {
        "checks": read_template("checks.h"),
        "exact": "\n".join(fill_template("self_test.c", _OF_TEST[each]) for each in reals),
        "is_exact": " && ".join(f"are_{each}s_exact()" for each in reals),
    }


def words_around() -> set[str]:
    """Names of members that the texts around the kernels look at."""
    files = [_FOLDER / each for each in ("adcs.c", "in_the_loop.c", "../harness/replay.c")]
    text = "\n".join(each.read_text(encoding="utf-8") for each in files)
    return set(re.findall(r"(?:->|\.)(\w+)", text))


def without_comments(text: str) -> str:
    """A text of C without its comments, which name things without using them."""
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def names_around() -> list[str]:
    """Names of functions, types and tables of the text around the kernels."""
    files = [each for pattern in _AROUND for each in sorted(_FOLDER.glob(pattern))]
    texts = [each.read_text(encoding="utf-8") for each in files]
    texts.append(self_test(("double", "float"))["exact"])
    text = without_comments("\n".join(texts))
    return re.findall(r"^[^\s#][^\n(\[;=]*?(\w+)\s*[(\[;=]", text, flags=re.M)
