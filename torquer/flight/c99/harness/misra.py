"""MISRA C:2012 by cppcheck: `make misra`, in the folder of the export.

The rules that are violated, and warnings of cppcheck itself, are compared with the list of
deviations in MISRA.md.
"""

import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
NAMES = ("adcs.c", "adcs_tables.c", "adcs_math.c", "adcs_ephemeris.c")
SOURCES = [name for name in NAMES if (HOME / name).exists()]
FLAGS = ["--std=c99", "--addon=misra", "--enable=warning,style,performance,portability"]
SKIPPED = 77
#: Notes on style that say nothing about flight: names of locals, where they are declared.
STYLE = ("style", "information")
BUILDS: tuple = ([], ["-DADCS_PORTABLE"])


def run_cppcheck() -> list:
    """What cppcheck finds in both builds: file and line, severity, id."""
    command = ["cppcheck", "--quiet", "--template={file}:{line}\t{severity}\t{id}", *FLAGS, "-I."]
    lines: set = set()
    for build in BUILDS:
        done = subprocess.run(
            [*command, *build, *SOURCES], cwd=HOME, capture_output=True, text=True, check=True
        )
        lines |= {line for line in done.stderr.splitlines() if line.count("\t") == 2}
    return [tuple(line.split("\t")) for line in sorted(lines)]


def list_deviations() -> set:
    """Rules and names of warnings in the list of deviations."""
    text = (HOME / "MISRA.md").read_text(encoding="utf-8")
    return set(re.findall(r"^\| (\d+\.\d+|[a-z]+[A-Z]\w+) \|", text, flags=re.M))


def main() -> int:
    """0 where all that is found is listed, 1 otherwise; 77 without cppcheck."""
    if not shutil.which("cppcheck"):
        print("skipped, nothing was checked: install cppcheck")
        return SKIPPED
    rules: Counter = Counter()
    listed = list_deviations()
    bad = []
    for place, severity, name in run_cppcheck():
        rule = re.match(r"misra-c2012-(\d+\.\d+)$", name)
        if rule:
            rules[rule[1]] += 1
        if (rule[1] if rule else name) not in listed and (rule or severity not in STYLE):
            bad.append(f"{place}: {name}")
    for rule, count in sorted(rules.items(), key=lambda item: [*map(int, item[0].split("."))]):
        print(f"rule {rule}: {count} places")
    print("\n".join(bad) or "no deviation that is not in MISRA.md")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
