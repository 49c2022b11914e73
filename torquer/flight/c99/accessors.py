"""What the interface reads of the state, as far as the state of a scenario has it."""

from string import Template

from torquer.flight.c99.computer import Export, OnBoard
from torquer.flight.c99.precision import is_single

#: How a function of the interface sees what is in the state.
_SEEN = "seen(state)"
_REGION = f"{_SEEN}->board.modes.regions[region]"
_IS_REGION = """\
static bool is_region(int32_t region)
{
    return region >= 0 && region < $count;
}

/* The number of a state; -1 for one that is damaged. */
static int32_t mode_of(double state)
{
    return (state >= 0.0 && state < $states.0) ? (int32_t)state : -1;
}

"""
#: What kernels note that have failed: it is cleared before a step, and kept after it.
_BEFORE = """\
    const int64_t before = own->board.failures.blocks;
    own->board.failures.blocks = 0;
"""
_AFTER = """\
    if (own->board.failures.blocks != 0) {
        answer.status |= ADCS_MET_LAW_FAILED;
        own->gate[0].status = (double)answer.status;
    }
    own->board.failures.blocks |= before;
"""
_FAILURES = f"""\
    *line = {_SEEN}->board.failures.line;
    return {_SEEN}->board.failures.blocks;
"""
_NO_FAILURES = """\
    (void)state;
    *line = 0;
    return 0;
"""
_NOTHING = "    (void)state;\n    (void){index};\n    return {none};\n"
#: The estimate: the clock's offset is added to its time.
_ESTIMATE = {
    "t_s": ("estimate_s",),
    "q_body_to_inertial": tuple(f"estimate_q_{c}" for c in "xyzw"),
    "omega_body_rad_s": tuple(f"estimate_omega_{c}" for c in "xyz"),
    "gyro_bias_rad_s": tuple(f"estimate_bias_{c}" for c in "xyz"),
    "sigma_rad": ("sigma_rad",), "sigma_rad_s": ("sigma_rad_s",),
}  # fmt: skip


def accessor_texts(computer: OnBoard, made: Export) -> dict[str, str]:
    """Texts of `adcs.c` for what a state may have or not."""
    reports = made.program.keeps(made.board, "failures")
    regions, board = len(computer.board.modes.regions), computer.board
    sizes = {"count": regions, "states": len(board.modes.states)}
    unread = "    (void)state;\n    (void)region;\n"
    return {
        "is_region": Template(_IS_REGION).substitute(sizes) if regions else "",
        "unread_region": "" if regions else unread,
        "mode": f"is_region(region) ? mode_of({_REGION}.state) : -1" if regions else "-1",
        "commanded": f"is_region(region) ? mode_of({_REGION}.commanded) : -1" if regions else "-1",
        "held": f"is_region(region) && {_REGION}.held > 0.0" if regions else "false",
        "before_step": _BEFORE if reports else "",
        "after_step": _AFTER if reports else "",
        "failures": _FAILURES if reports else _NO_FAILURES,
        "logged": _cell("cell", "memory", len(board.memory)),
        "parameter": _cell("place", "parameters", len(board.parameters), "(double)" * is_single()),
        "flag": _flag(len(board.modes.flags)),
        "estimated": ", ".join(_estimate(made)),
    }  # fmt: skip


def estimated_members(made: Export) -> set[str]:
    """Members of an `adcs_estimate` that are estimated, or read from sensors in its place."""
    return {member for member, names in _ESTIMATE.items() if {*names} <= {*made.known}}


def _cell(index: str, part: str, count: int, cast: str = "") -> str:
    """A number of an array, NaN beyond it."""
    if not count:
        return _NOTHING.format(index=index, none="(double)NAN")
    cell = f"{cast}{_SEEN}->board.{part}[{index}]"
    return f"    return ({index} >= 0 && {index} < {count}) ? {cell} : (double)NAN;\n"


def _flag(count: int) -> str:
    if not count:
        return _NOTHING.format(index="flag", none="false")
    cell = f"{_SEEN}->board.modes.flags[flag]"
    return f"    return flag >= 0 && flag < {count} && {cell} > 0.0;\n"


def _estimate(made: Export) -> list[str]:
    """Initialisers of the estimate, NaN for what is not estimated."""
    known, texts = made.known, []
    for names in _ESTIMATE.values():
        numbers = [
            f"{_SEEN}->board.known[0].{name}" if name in known else "(double)NAN" for name in names
        ]
        texts.append(f"{{{', '.join(numbers)}}}" if len(names) > 1 else numbers[0])
    if "estimate_s" in known:
        texts[0] += f" + {_SEEN}->gate[0].offset_s"
    return texts
