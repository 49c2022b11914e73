"""Telemetry: named against true cause of synthetic passes of 2 min to 10 h.

`python benchmarks/diagnosis.py [FIRST] [COUNT]`: a table in Markdown by length, one by cause, and
processor time; seeds from FIRST [8000] on, 400 passes.
"""

import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import numpy as np
from telemetry_passes import FAULTS, can_be_told, is_right, make_pass, named

SILENT = ("stated", "too short")
LENGTHS_MIN = (0.0, 15.0, 45.0, 90.0, 1e9)
LENGTH_NAMES = ("below 15 min", "15 to 45 min", "45 to 90 min", "from 90 min on")


def main() -> None:
    first, count = (int(each) for each in (*sys.argv[1:], "8000", "400")[:2])
    by_length: dict[int, Counter] = defaultdict(Counter)
    by_fault: dict[str, Counter] = defaultdict(Counter)
    took = []
    for seed in range(first, first + count):
        each = make_pass(seed)
        start = time.process_time()
        verdict, rivals = named(each)
        took.append(time.process_time() - start)
        length = int(np.searchsorted(LENGTHS_MIN, each.span_s / 60.0, "right")) - 1
        right = is_right(each, verdict, rivals)
        if each.fault == "stated":
            by_length[length].update(right_files=1, accused=int(verdict not in SILENT))
        elif can_be_told(each):
            outcome = (
                "named" if right else "silent" if verdict in SILENT
                else "nothing fits" if verdict == "nothing fits" else "wrong"
            )  # fmt: skip
            by_length[length].update({"faulty": 1, outcome: 1})
        else:
            by_length[length].update(not_told=1, wrong=int(verdict not in SILENT and not right))
        by_fault[each.fault][verdict] += 1
    heads = (
        "right_files",
        "accused",
        "faulty",
        "named",
        "silent",
        "nothing fits",
        "wrong",
        "not_told",
    )
    print("| Length |", " | ".join(heads), "|")
    for length, name in enumerate(LENGTH_NAMES):
        print(f"| {name} |", " | ".join(str(by_length[length][head]) for head in heads), "|")
    for fault in FAULTS:
        print(f"{fault}: {dict(by_fault[fault].most_common())}")
    print(f"processor time: median {np.median(took):.2f} s, at most {max(took):.2f} s")


if __name__ == "__main__":
    main()
