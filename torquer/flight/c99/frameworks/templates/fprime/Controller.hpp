// The on-board computer of $name as a component of F Prime, exported by torquer $version.
#ifndef ADCS_CONTROLLER_HPP
#define ADCS_CONTROLLER_HPP

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <atomic>

extern "C" {
#include "adcs_cycle.h"
}

#include "ControllerComponentAc.hpp"

namespace Adcs {

class Controller final : public ControllerComponentBase {
  public:
    //! Construct a Controller, which asserts that this build computes with the bits of the export
    explicit Controller(const char* const compName);

    ~Controller();

  private:
    //! Handler for port schedIn
    void schedIn_handler(FwIndexType portNum, U32 context) override;

    //! Handler for command REBASE
    void REBASE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 shift_s) override;

    //! Handler for command RESTART_ESTIMATORS
    void RESTART_ESTIMATORS_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) override;

    //! Handler for command CLEAR_EVENT_THROTTLE
    void CLEAR_EVENT_THROTTLE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) override;

$handlers$parameter_overrides    //! The control step that is due, and what follows from it
    void step();

    //! Hand the commands to the drivers
    void drive();

    //! Events of what the step has met
    void report(F64 t_s);

    //! All channels
    void writeTelemetry();

    //! Confirm a command that took effect; say of another that it was refused
    void answer(FwOpcodeType opCode, U32 cmdSeq, adcs_outcome outcome);

    //! Take over parameters that the ground has set
    void applyParameters();

    //! Set a number of a parameter, unless it is that already
    void setParameter(int32_t place, F64 value);

    adcs_cycle m_cycle;
    std::atomic<bool> m_areParametersNew;
};

}  // namespace Adcs

#endif
