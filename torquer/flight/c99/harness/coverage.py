"""What the recorded flight reaches of the code, by gcov: `make coverage`, in the export's folder.

Builds the replay with counters and without optimisation, replays `recorded.bin`, and writes
`COVERAGE.md`: lines and branches by function, what was never reached, with the Python source and
the requirements of each function (`TRACE.csv`). A replay that finds another bit ends it.
"""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
BUILD = HOME / "build" / "coverage"
NAMES = ("adcs.c", "adcs_tables.c", "adcs_ephemeris.c")
SOURCES = [HOME / name for name in NAMES if (HOME / name).exists()]
FLAGS = ["-std=c99", "-O0", "-ffp-contract=off", "--coverage", f"-I{HOME}"]
IS_SINGLE = "in single precision" in (HOME / "adcs.h").read_text()
NEEDED = {"cc": "gcc", "gcov": "gcc"}
SKIPPED = 77


def run(command: list) -> str:
    """What a command prints; ends the program with its words where it fails."""
    done = subprocess.run(list(map(str, command)), cwd=BUILD, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def replay() -> str:
    """Build and replay; what the replay says. In single precision it has no bits to compare."""
    for source in [*SOURCES, HOME / "test" / "replay.c"]:
        run(["cc", *FLAGS, "-c", source, "-o", f"{source.stem}.o"])
    objects = [f"{source.stem}.o" for source in SOURCES]
    run(["cc", "--coverage", *objects, "replay.o", "-o", "replay", "-lm"])
    answers = ["answers.bin"] if IS_SINGLE else []
    return run(["./replay", HOME / "test" / "recorded.bin", *answers]).strip()


def functions() -> list:
    """Each function with its lines (number, how often) and branches (line, how often)."""
    found = []
    for source in SOURCES:
        text = run(["gcov", "--json-format", "--branch-probabilities", "--stdout", source.stem])
        for file in json.loads(text)["files"]:
            if Path(file["file"]).name == source.name:
                found += [_function(source.name, each, file["lines"]) for each in file["functions"]]
    return found


def _function(file: str, function: dict, lines: list) -> dict:
    own = [each for each in lines if each.get("function_name") == function["name"]]
    return {
        "file": file, "name": function["name"], "calls": function["execution_count"],
        "lines": [(each["line_number"], each["count"]) for each in own],
        "branches": [(e["line_number"], b["count"]) for e in own for b in e["branches"]],
    }  # fmt: skip


def share(counts: list) -> str:
    """How many of the places were reached, of how many."""
    return f"{sum(count > 0 for _, count in counts)} / {len(counts)}" if counts else "-"


def origins() -> dict:
    """Python source and requirements of each function, from the table of the export."""
    with (HOME / "TRACE.csv").open(encoding="utf-8") as file:
        return {(row["file"], row["function"]): row for row in csv.DictReader(file)}


def row_of(each: dict, known: dict) -> str:
    """A row of the report."""
    row = known.get((each["file"], each["name"]), {})
    place = f"{row['source']}:{row['first_line']}" if row.get("first_line") else "of the export"
    missed = sorted({line for line, count in [*each["lines"], *each["branches"]] if not count})
    left = "never called" if not each["calls"] else ", ".join(map(str, missed))
    cells = (
        f"{each['file']}: {each['name']}", place, row.get("requirements", ""),
        share(each["lines"]), share(each["branches"]), left,
    )  # fmt: skip
    return f"| {' | '.join(cells)} |\n"


def report(said: str, found: list) -> str:
    """The whole report."""
    lines = [each for one in found for each in one["lines"]]
    branches = [each for one in found for each in one["branches"]]
    known = origins()
    version = run(["gcov", "--version"]).partition("\n")[0]
    return (
        f"# What the recorded flight reaches\n\n{version}; {said}.\n\n"
        f"Lines: {share(lines)}. Branches: {share(branches)}. Functions never called: "
        f"{sum(not one['calls'] for one in found)} of {len(found)}.\n\n"
        "What is left: lines of C that were never reached, or with a branch that was never taken.\n"
        "A flight says nothing of what it does not meet: failures, other modes, commands.\n\n"
        "| function | source | requirements | lines | branches | left |\n"
        "|---|---|---|---|---|---|\n" + "".join(row_of(one, known) for one in found)
    )


def main() -> int:
    """0 with a report; 77 where a tool is missing."""
    missing = sorted({package for tool, package in NEEDED.items() if not shutil.which(tool)})
    if missing:
        print(f"skipped, nothing was measured: install {', '.join(missing)}")
        return SKIPPED
    shutil.rmtree(BUILD, ignore_errors=True)  # counters add to those of an earlier run
    BUILD.mkdir(parents=True)
    text = report(replay().replace("\n", "; "), functions())
    (HOME / "COVERAGE.md").write_text(text, encoding="utf-8")
    print(text.split("\n\n")[2])
    return 0


if __name__ == "__main__":
    sys.exit(main())
