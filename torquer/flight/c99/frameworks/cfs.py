"""An app for cFS around the library: messages, commands, housekeeping, a table of parameters."""

import math

from torquer.computer.blocks.limits import Limits
from torquer.flight.c99.frameworks.declared import Declared, Parameter, fill_all

CFS_FILES = tuple(
    f"cfs/adcs_app/{name}"
    for name in (
        *("CMakeLists.txt", "fsw/inc/adcs_app_events.h", "fsw/inc/adcs_app_msg.h"),
        *("fsw/inc/adcs_app_msgids.h", "fsw/inc/adcs_app_perfids.h", "fsw/inc/adcs_app_tbl.h"),
        *("fsw/src/adcs_app.c", "fsw/src/adcs_app.h", "fsw/src/adcs_app_cmds.c"),
        "fsw/tables/adcs_app_tbl.c",
    )
)


def cfs_texts(declared: Declared) -> dict[str, str]:
    """The app's files, in `cfs/adcs_app/`."""
    settable = [each for each in declared.parameters if each.is_settable and each.values]
    places = declared.general() | {
        "met_texts": "".join(f'    "{each.said}",\n' for each in declared.met),
        "met_count": str(len(declared.met)),
        "mode_members": _mode_members(declared),
        "mode_reports": _mode_reports(declared),
        "numbers": str(sum(len(each.values) for each in settable)),
        "table_members": "".join(
            f"    double {each.name}{_size(each)}; /* {each.said} */\n" for each in settable
        ),
        "table_values": "".join(f",\n    {_values(each)}" for each in settable),
        "table_checks": "".join(_each_number(each, _CHECK) for each in settable),
        "table_applies": "".join(_each_number(each, _SET) for each in settable) or _NOTHING_SET,
    }  # fmt: skip
    return fill_all(CFS_FILES, places)


_CHECK = "    AreRight = AreRight && isfinite(Table->{value}){limits};\n"
_SET = "    ADCS_APP_SetParameter(ADCS_PARAMETER_{name}{offset}, Table->{value});\n"
_NOTHING_SET = "    (void)Table;\n    (void)ADCS_APP_SetParameter;\n"


def _size(parameter: Parameter) -> str:
    return f"[{len(parameter.values)}]" if len(parameter.values) > 1 else ""


def _values(parameter: Parameter) -> str:
    texts = [repr(each) for each in parameter.values]
    return f"{{{', '.join(texts)}}}" if len(texts) > 1 else texts[0]


def _each_number(parameter: Parameter, text: str) -> str:
    """A line for each number of a parameter."""
    name, many = parameter.name, len(parameter.values) > 1
    lines = []
    for k, limits in enumerate(parameter.limits):
        value, offset = (f"{name}[{k}]", f" + {k}") if many else (name, "")
        within = _within(f"Table->{value}", limits)
        lines.append(text.format(name=name, offset=offset, value=value, limits=within))
    return "".join(lines)


def _within(value: str, limits: Limits) -> str:
    """That a number is within its limits, to follow another condition."""
    sides = (
        (limits.least, ">" if limits.above else ">="),
        (limits.greatest, "<" if limits.below else "<="),
    )
    texts = (f" && {value} {sign} {side!r}" for side, sign in sides if math.isfinite(side))
    return "".join(texts)


def _mode_members(declared: Declared) -> str:
    """Members of the housekeeping packet for regions and flags."""
    lines = [
        f"    int32 {each.itself.name}; /* state of {each.itself.said} */\n"
        for each in declared.regions
    ]
    lines += [
        f"    uint8 HELD_{each.itself.name}; /* whether its transitions are kept */\n"
        for each in declared.regions
    ]
    lines += [f"    uint8 {each.name}; /* {each.said} */\n" for each in declared.flags]
    return "".join(lines)


def _mode_reports(declared: Declared) -> str:
    lines = []
    for each in declared.regions:
        name = each.itself.name
        lines.append(
            f"    Hk->{name} = adcs_mode(StatePtr, ADCS_{name});\n"
            f"    Hk->HELD_{name} = adcs_is_held(StatePtr, ADCS_{name}) ? 1 : 0;\n"
        )
    for flag in declared.flags:
        lines.append(f"    Hk->{flag.name} = adcs_flag(StatePtr, ADCS_{flag.name}) ? 1 : 0;\n")
    return "".join(lines)  # fmt: skip
