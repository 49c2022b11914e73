"""Texts of the files of an export: `templates/` has them with places for what differs."""

from pathlib import Path
from string import Template

_FOLDER = Path(__file__).parent / "templates"
#: What differs in single precision.
PRECISION = """\
/* Kernels compute in single precision, but for times; interface and memory hold doubles. */

"""
SINGLE_TEST = """\
/* Whether floats have their bits, too. */
static bool is_single_exact(void)
{
    volatile float a = 1.0f + 0x1p-12f;
    volatile float b = -(1.0f + 0x1p-11f);
    volatile float least = 0x1p-149f;
    const float x = a;
    const float y = b;
    return x * x + y == 0.0f && least * 1.0f > 0.0f && sizeof(float) == 4u;
}

"""


def read_template(file: str) -> str:
    """A file of `templates/` as it is."""
    return (_FOLDER / file).read_text(encoding="utf-8")


def fill_template(file: str, places: dict[str, str]) -> str:
    """A file of `templates/` with its places (`$name`) filled."""
    return Template(read_template(file)).substitute(places)
