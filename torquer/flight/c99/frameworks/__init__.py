"""What carries an exported computer in a flight framework: F Prime, cFS, FreeRTOS."""

from collections.abc import Callable

from torquer.flight.c99.computer import OnBoard
from torquer.flight.c99.frameworks.cfs import CFS_FILES, cfs_texts
from torquer.flight.c99.frameworks.cycle import CYCLE_FILES, cycle_texts
from torquer.flight.c99.frameworks.declared import Declared, declare
from torquer.flight.c99.frameworks.fprime import FPRIME_FILES, fprime_texts
from torquer.flight.c99.frameworks.freertos import FREERTOS_FILES, freertos_texts
from torquer.flight.c99.interface import Input

#: Who writes the files of a framework from what the export declares.
FRAMEWORKS: dict[str, Callable[[Declared], dict[str, str]]] = {
    "fprime": fprime_texts, "cfs": cfs_texts, "freertos": freertos_texts,
}  # fmt: skip
#: All files that a framework may have.
FRAMEWORK_FILES = frozenset({*CYCLE_FILES, *FPRIME_FILES, *CFS_FILES, *FREERTOS_FILES})


def framework_texts(
    computer: OnBoard, framework: str, inputs: list[Input], has_ephemeris: bool = False
) -> dict[str, str]:
    """Texts of a component, app or task around the library, by the names of their files."""
    declared = declare(computer, inputs, has_ephemeris)
    return cycle_texts(declared) | FRAMEWORKS[framework](declared)
