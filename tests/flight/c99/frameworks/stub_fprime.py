"""A stub of what F Prime generates from the model of the component: `ControllerComponentAc.hpp`.

It follows the signatures that `fpp-to-cpp` writes, keeps what is sent, and lets a harness play
the ports around the component.
"""

import re

_NUMBERS = ("U32", "I32", "I64", "F64", "bool")
_SEVERITIES = {
    "warning high": "WARNING_HI",
    "warning low": "WARNING_LO",
    "activity high": "ACTIVITY_HI",
}
_HEAD = """\
// A stub: the base class that F Prime would generate from Controller.fpp.
#ifndef CONTROLLER_COMPONENT_AC_STUB_HPP
#define CONTROLLER_COMPONENT_AC_STUB_HPP
#include "fw_stub.hpp"
namespace Adcs {
"""
_ARRAY = """\
struct {name} {{
    F64 elements[{count}];
    {name}() : elements() {{}}
    {name}({arguments}) : elements{{{elements}}} {{}}
    F64& operator[](FwSizeType k) {{ return this->elements[k]; }}
    const F64& operator[](FwSizeType k) const {{ return this->elements[k]; }}
}};
inline std::vector<double> numbers(const {name}& v) {{
    return {{v.elements, v.elements + {count}}};
}}
"""
_ENUM = """\
struct {name} {{
    enum T {{ {members} }};
    T e;
    {name}(T value = static_cast<T>(0)) : e(value) {{}}
}};
inline std::vector<double> numbers(const {name}& v) {{ return {{static_cast<double>(v.e)}}; }}
"""
_CLASS = """\
class ControllerComponentBase {{
  public:
    Sent sent;
    bool (*source)(Inputs&) = nullptr;
    void (*sink)(const Actuation&) = nullptr;
    Fw::ParamValid validity;
    void tick() {{ this->schedIn_handler(0, 0); }}
    void callParameterUpdated(FwPrmIdType id) {{ this->parameterUpdated(id); }}
    virtual ~ControllerComponentBase() {{}}
    enum {{ {ids} }};
  protected:
    explicit ControllerComponentBase(const char* compName = "") {{ (void)compName; }}
    virtual void schedIn_handler(FwIndexType portNum, U32 context) = 0;
    virtual void parameterUpdated(FwPrmIdType id) {{ (void)id; }}
    virtual void parametersLoaded() {{}}
    bool inputsGet_out(FwIndexType, Inputs& inputs) const {{ return this->source(inputs); }}
    void actuate_out(FwIndexType, const Actuation& actuation) const {{ this->sink(actuation); }}
    void cmdResponse_out(FwOpcodeType, U32, Fw::CmdResponse response) {{
        this->sent.responses.push_back(response.e);
    }}
{members}}};
"""


def passed(kind: str, name: str) -> str:
    """An argument as F Prime passes it."""
    return f"{kind} {name}" if kind in _NUMBERS else f"const {kind}& {name}"


def arguments_of(text: str) -> list[tuple[str, str]]:
    """(type, name) of each argument of a command or event."""
    pairs = (each.split(":") for each in text.split(",") if each.strip())
    return [(kind.strip(), name.strip()) for name, kind in pairs]


def stub_base(model: str) -> str:
    """The stub's header for the text of a model."""
    model = model.replace("\\\n", " ")
    parts = [_HEAD]
    for name, count in re.findall(r"^  array (\w+) = \[(\d+)\] F64$", model, re.M):
        names = [f"e{k}" for k in range(int(count))]
        parts.append(
            _ARRAY.format(
                name=name,
                count=count,
                elements=", ".join(names),
                arguments=", ".join(f"F64 {each}" for each in names),
            )
        )
    for name, body in re.findall(r"^  enum (\w+) : I32 \{\n(.*?)^  \}", model, re.M | re.S):
        members = ", ".join(re.findall(r"^    (\w+ = \d+)", body, re.M))
        parts.append(_ENUM.format(name=name, members=members))
    for name, body in re.findall(r"^  struct (\w+) \{\n(.*?)^  \}", model, re.M | re.S):
        parts.append(_struct(name, re.findall(r"^    (\w+): (\w+)", body, re.M)))
    return "".join([*parts, _base_class(model), "}  // namespace Adcs\n#endif\n"])


def _struct(name: str, members: list[tuple[str, str]]) -> str:
    lines = [f"struct {name} {{\n    {name}() {{}}\n"]
    arguments = ", ".join(passed(kind, member) for member, kind in members)
    values = ", ".join(f"m_{member}({member})" for member, _ in members)
    lines.append(f"    {name}({arguments}) : {values} {{}}\n")
    for member, kind in members:
        if kind == "F64":
            lines.append(f"    F64 get_{member}() const {{ return this->m_{member}; }}\n")
        else:
            lines.append(
                f"    {kind}& get_{member}() {{ return this->m_{member}; }}\n"
                f"    const {kind}& get_{member}() const {{ return this->m_{member}; }}\n"
            )
        lines.append(f"    void set_{member}({passed(kind, 'v')}) {{ this->m_{member} = v; }}\n")
    lines += [f"    {kind} m_{member}{{}};\n" for member, kind in members]
    return "".join(lines) + "};\n"


def _base_class(model: str) -> str:
    lines, ids = [], ["NOTHING = -1"]
    for name, text in re.findall(r"command (\w+)\((.*?)\) opcode", model):
        arguments = "".join(f", {passed(*each)}" for each in arguments_of(text))
        handed = "".join(f", {each}" for _, each in arguments_of(text))
        lines.append(
            f"    virtual void {name}_cmdHandler(FwOpcodeType opCode, U32 cmdSeq{arguments})"
            f" = 0;\n  public:\n    void send_{name}({arguments[2:]})"
            f" {{ this->{name}_cmdHandler(0, 0{handed}); }}\n  protected:\n"
        )
    events = re.findall(r"event (\w+)\((.*?)\)\s+severity (\w+ \w+)(.*)", model)
    for name, text, severity, rest in events:
        arguments = ", ".join(passed(*each).rsplit(" ", 1)[0] for each in arguments_of(text))
        functions = [(f"log_{_SEVERITIES[severity]}_{name}", arguments, "events")]
        if " throttle " in rest:
            functions.append((f"{functions[0][0]}_ThrottleClear", "", "cleared"))
        lines += [
            f'    void {function}({given}) {{ this->sent.{kept}.push_back("{name}"); }}\n'
            for function, given, kept in functions
        ]
    for name, kind in re.findall(r"telemetry (\w+): (\w+) id", model):
        as_numbers = "number(static_cast<double>(v))" if kind in _NUMBERS else "numbers(v)"
        lines.append(
            f"    void tlmWrite_{name}({passed(kind, 'v')})"
            f' {{ this->sent.channels["{name}"] = {as_numbers}; }}\n'
        )
    for name, kind, number in re.findall(r"param (\w+): (\w+) default .*? id (\d+)", model):
        lines.append(
            f"  public:\n    {kind} prm_{name}{{}};\n  protected:\n"
            f"    {kind} paramGet_{name}(Fw::ParamValid& how)"
            f" {{ how = this->validity; return this->prm_{name}; }}\n"
        )
        ids.append(f"PARAMID_{name} = {number}")
    return _CLASS.format(members="".join(lines), ids=", ".join(ids))
