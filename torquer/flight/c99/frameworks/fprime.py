"""A component for F Prime around the library: its model in FPP, its implementation in C++."""

from torquer.flight.c99.frameworks.declared import Declared, Named, Parameter, copied, fill_all
from torquer.flight.c99.interface import Input

FPRIME_FILES = tuple(
    f"fprime/Controller/{name}"
    for name in ("Controller.fpp", "Controller.hpp", "Controller.cpp", "CMakeLists.txt")
)
#: How many events of a kind go out until the ground clears the count.
_THROTTLE = 10
#: Identifiers of the first parameter and event of those that follow the scenario.
_FIRST = 0x20


def fprime_texts(declared: Declared) -> dict[str, str]:
    """The component's files, in `fprime/Controller/`."""
    places = declared.general() | _model(declared) | _implementation(declared)
    return fill_all(FPRIME_FILES, places)


def _numbers(count: int) -> str:
    """The type of so many numbers."""
    return f"F64x{count}" if count > 1 else "F64"


def _enum(name: str, of: list[Named]) -> str:
    rows = "".join(f"    {each.name} = {each.number} @< {each.said}\n" for each in of)
    return f"  enum {name} : I32 {{\n{rows}  }}\n\n"


def _mode_type(region: Named) -> str:
    return f"Mode_{region.name.removeprefix('REGION_')}"


def _settable(declared: Declared) -> list[Parameter]:
    return [each for each in declared.parameters if each.is_settable and each.values]


def _model(declared: Declared) -> dict[str, str]:
    """Places of the model."""
    counts = {each.count for each in declared.inputs} | {3, 4}
    counts |= {len(each.values) for each in _settable(declared)}
    enums = [_enum("Outcome", declared.outcomes)]
    if declared.regions:
        enums.append(_enum("Region", [each.itself for each in declared.regions]))
        enums += [_enum(_mode_type(each.itself), each.states) for each in declared.regions]
    if declared.flags:
        enums.append(_enum("Flag", declared.flags))
    return {
        "arrays": "".join(f"  array F64x{n} = [{n}] F64\n" for n in sorted(counts - {1})),
        "enums": "".join(enums),
        "members": "".join(
            f"    {each.name}: {_numbers(each.count)} @< {each.meaning}\n"
            for each in declared.inputs
        ),
        "mode_commands": _mode_commands(declared),
        "met_events": "".join(
            f"    @ {each.said}\n"
            f"    event {each.name}(t_s: F64) severity warning low id {_FIRST + k} "
            f'format "{each.said}; at {{}} s" throttle {_THROTTLE}\n\n'
            for k, each in enumerate(declared.met)
        ),
        "mode_channels": _mode_channels(declared),
        "parameters": "".join(
            f"    @ {each.said}\n    param {each.name}: {_numbers(len(each.values))} "
            f"default {_default(each.values)} id {k} "
            f"set opcode {_FIRST + 2 * k} save opcode {_FIRST + 2 * k + 1}\n\n"
            for k, each in enumerate(_settable(declared))
        ),
        "parameter_ports": _PARAMETER_PORTS if _settable(declared) else "",
    }  # fmt: skip


_PARAMETER_PORTS = """
    param get port prmGetOut

    param set port prmSetOut
"""


def _default(values: list[float]) -> str:
    texts = [repr(each) for each in values]
    return f"[{', '.join(texts)}]" if len(texts) > 1 else texts[0]


def _mode_commands(declared: Declared) -> str:
    """Commands that there are for a mode table, and one for each of its regions."""
    lines = []
    for k, each in enumerate(declared.regions):
        name = _mode_type(each.itself)
        lines.append(
            f"    @ Have {each.itself.said} enter a state at the next step\n"
            f"    async command SET_{name.upper()}(mode: {name}) opcode {0x800 + k}\n\n"
        )
    if declared.regions:
        lines.append(
            "    @ Keep the transitions of a region from firing, or let them again\n"
            "    async command HOLD(region: Region, keep: bool) opcode 3\n\n"
        )
    if declared.flags:
        lines.append(
            "    @ Raise or lower a flag\n"
            "    async command SET_FLAG(flag: Flag, raised: bool) opcode 4\n\n"
        )
    return "".join(lines)


def _mode_channels(declared: Declared) -> str:
    lines, number = [], 0x40
    for each in declared.regions:
        name = _mode_type(each.itself)
        lines.append(
            f"    @ State of {each.itself.said}\n"
            f"    telemetry {name}: {name} id {number} update on change\n\n"
        )
        held = each.itself.name
        lines.append(
            f"    @ Whether the transitions of {each.itself.said} are kept\n"
            f"    telemetry HELD_{held}: bool id {number + 1} update on change\n\n"
        )
        number += 2
    for flag in declared.flags:
        lines.append(
            f"    @ Whether {flag.said} is raised\n"
            f"    telemetry {flag.name}: bool id {number} update on change\n\n"
        )
        number += 1
    return "".join(lines)  # fmt: skip


def _place(input_: Input) -> str:
    """Where a number stands in what the model has for an input."""
    return "$place" if input_.count > 1 else ""


def _implementation(declared: Declared) -> dict[str, str]:
    """Places of the implementation."""
    settable = _settable(declared)
    return {
        "handlers": _handlers(declared, _HANDLER),
        "definitions": _handlers(declared, _DEFINITION),
        "copies": "".join(
            line.replace("$name", each.name)
            for each in declared.inputs
            for line in copied(f"    given.$name$place = inputs.get_$name(){_place(each)};\n", each)
        ),
        "met_reports": "".join(
            f"    if ((risen & ADCS_{each.name}) != 0U) {{\n"
            f"        this->log_WARNING_LO_{each.name}(t_s);\n    }}\n"
            for each in declared.met
        ),
        "met_clears": "".join(
            f"    this->log_WARNING_LO_{each.name}_ThrottleClear();\n" for each in declared.met
        ),
        "mode_reports": _mode_reports(declared),
        "parameter_overrides": _OVERRIDES if settable else "",
        "parameter_definitions": _OVERRIDDEN if settable else "",
        "applies": "".join(map(_apply, settable)) or "    (void)valid;\n",
    }  # fmt: skip


_HANDLER = """\
    //! Handler for command $command
    void ${command}_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, $arguments) override;

"""
_DEFINITION = """\
void Controller ::${command}_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, $arguments) {
    this->answer(opCode, cmdSeq, $call);
}

"""
_OVERRIDES = """\
    //! A parameter was set: it is taken over at the next tick, in the component's own thread
    void parameterUpdated(FwPrmIdType id) override;

    //! The parameters were loaded
    void parametersLoaded() override;

"""
_OVERRIDDEN = """\
void Controller ::parameterUpdated(FwPrmIdType id) {
    (void)id;
    this->m_areParametersNew = true;
}

void Controller ::parametersLoaded() {
    this->m_areParametersNew = true;
}

"""


def _handlers(declared: Declared, text: str) -> str:
    """The handlers of commands that follow the scenario, declared or defined."""
    rows = [
        (f"SET_{_mode_type(each.itself).upper()}", f"{_mode_type(each.itself)} mode",
         f"adcs_command_mode(state, ADCS_{each.itself.name}, static_cast<int32_t>(mode.e))")
        for each in declared.regions
    ]  # fmt: skip
    if declared.regions:
        call = "adcs_hold(state, static_cast<int32_t>(region.e), keep)"
        rows.append(("HOLD", "Region region, bool keep", call))
    if declared.flags:
        call = "adcs_set_flag(state, static_cast<int32_t>(flag.e), raised)"
        rows.append(("SET_FLAG", "Flag flag, bool raised", call))
    return "".join(_handler(text, *row) for row in rows)


def _handler(text: str, command: str, arguments: str, call: str) -> str:
    kinds = [each.rsplit(" ", 1) for each in arguments.split(", ")]
    words = [
        f"{kind} {name}" if kind == "bool" else f"const {kind}& {name}" for kind, name in kinds
    ]
    call = call.replace("(state", "(&this->m_cycle.state")
    filled = text.replace("${command}", command).replace("$command", command)
    return filled.replace("$arguments", ", ".join(words)).replace("$call", call)


def _mode_reports(declared: Declared) -> str:
    text = "    this->tlmWrite_{}({});\n"
    lines = []
    for each in declared.regions:
        name, itself = _mode_type(each.itself), each.itself.name
        mode = f"static_cast<{name}::T>(adcs_mode(state, ADCS_{itself}))"
        lines.append(text.format(name, f"{name}({mode})"))
        lines.append(text.format(f"HELD_{itself}", f"adcs_is_held(state, ADCS_{itself})"))
    for flag in declared.flags:
        lines.append(text.format(flag.name, f"adcs_flag(state, ADCS_{flag.name})"))
    return "".join(lines)


def _apply(parameter: Parameter) -> str:
    """Statements that take over a parameter that the ground has set."""
    count, name = len(parameter.values), parameter.name
    set_ = "this->setParameter(ADCS_PARAMETER_{}{}, value{});"
    if count > 1:
        one = set_.format(name, " + k", "[static_cast<FwSizeType>(k)]")
        body = f"for (int32_t k = 0; k < {count}; k++) {{\n                {one}\n            }}"
    else:
        body = set_.format(name, "", "")
    return (
        f"    {{\n        const {_numbers(count)} value = this->paramGet_{name}(valid);\n"
        f"        if (valid == Fw::ParamValid::VALID) {{\n            {body}\n        }}\n    }}\n"
    )
