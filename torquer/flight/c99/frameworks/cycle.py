"""The control cycle around the library, which all frameworks share: ticks, steps, coils."""

from torquer.flight.c99.frameworks.declared import Declared, fill

CYCLE_FILES = ("adcs_cycle.h", "adcs_cycle.c")


def cycle_texts(declared: Declared) -> dict[str, str]:
    """`adcs_cycle.h` and `adcs_cycle.c`, beside the library."""
    times = declared.schedule
    places = declared.general() | {
        "tick_ns": str(times.tick_ns), "cycle": str(times.cycle), "measure": str(times.measure),
        "sample": str(times.sample), "while_acting": str(int(times.while_acting)),
        "outcomes": "".join(
            f"    case ADCS_{each.name}:\n        return \"{each.said}\";\n"
            for each in declared.outcomes
        ),
    }  # fmt: skip
    return {name: fill(name, places) for name in CYCLE_FILES}
