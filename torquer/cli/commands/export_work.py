"""Work of `export c`: the files of an export, and what was written."""

from pathlib import Path

from torquer.base.strict_json import json_text
from torquer.cli.commands.export import ExportOptions
from torquer.cli.loading import load_usable
from torquer.cli.options import CodeOptions
from torquer.cli.output import harmless, writing_to
from torquer.flight.c99.export import STEPS, export_c


def export(path: Path, how: ExportOptions, code: CodeOptions) -> int:
    """Export the computer of a scenario into a folder."""
    scenario = load_usable(path, code, how.out)
    with writing_to(how.out):
        steps = STEPS if how.steps is None else how.steps
        files = export_c(scenario, how.out, steps, how.real, how.ephemeris)
    if how.json:
        print(json_text({"scenario": scenario.name, "files": [str(file) for file in files]}))
        return 0
    names = ", ".join(str(file.relative_to(how.out)) for file in files)
    print(harmless(f"{scenario.name}: written to {how.out}: {names}"))
    print("build and replay: cmake -B build && cmake --build build && ctest --test-dir build")
    return 0
