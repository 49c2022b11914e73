// A stub: the little of F Prime's headers that a component's implementation names.
#ifndef FW_STUB_HPP
#define FW_STUB_HPP

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

using U32 = std::uint32_t;
using I32 = std::int32_t;
using I64 = std::int64_t;
using F64 = double;
using FwIndexType = std::int16_t;
using FwOpcodeType = std::uint32_t;
using FwPrmIdType = std::uint32_t;
using FwSizeType = std::uint64_t;

namespace Fw {

struct CmdResponse {
    enum T { OK, INVALID_OPCODE, VALIDATION_ERROR, FORMAT_ERROR, EXECUTION_ERROR, BUSY };
    T e;
    CmdResponse(T value = OK) : e(value) {}
};

struct ParamValid {
    enum T { UNINIT, VALID, INVALID, DEFAULT };
    T e;
    ParamValid(T value = UNINIT) : e(value) {}
    bool operator==(T value) const { return this->e == value; }
};

}  // namespace Fw

//! What the stub's component has sent
struct Sent {
    std::vector<std::string> events;
    std::map<std::string, std::vector<double>> channels;
    std::vector<Fw::CmdResponse::T> responses;
    std::vector<std::string> cleared;
};

inline std::vector<double> number(double value) { return {value}; }

#endif
