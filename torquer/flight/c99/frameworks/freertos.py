"""A periodic task for FreeRTOS around the library, with hooks for the board's drivers."""

from torquer.flight.c99.frameworks.declared import Declared, fill_all

FREERTOS_FILES = ("freertos/CMakeLists.txt", "freertos/adcs_task.c", "freertos/adcs_task.h")


def freertos_texts(declared: Declared) -> dict[str, str]:
    """The task's files, in `freertos/`."""
    places = declared.general() | {"met_count": str(len(declared.met))}
    return fill_all(FREERTOS_FILES, places)
