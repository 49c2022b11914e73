// The on-board computer of $name as a component of F Prime, exported by torquer $version.
#include "Controller.hpp"
#include "Fw/Types/Assert.hpp"

namespace Adcs {

Controller ::Controller(const char* const compName)
    : ControllerComponentBase(compName), m_cycle(), m_areParametersNew(false) {
    FW_ASSERT(adcs_self_test());
    adcs_cycle_begin(&this->m_cycle);
}

Controller ::~Controller() {}

void Controller ::schedIn_handler(FwIndexType portNum, U32 context) {
    (void)portNum;
    (void)context;
    if (this->m_areParametersNew.exchange(false)) {
        this->applyParameters();
    }
    if (adcs_cycle_is_due(&this->m_cycle)) {
        this->step();
    }
    adcs_cycle_tick(&this->m_cycle);
}

void Controller ::step() {
    Inputs inputs;
    adcs_inputs given = {};
    if (adcs_cycle_opens_window(&this->m_cycle)) {
        this->drive();
    }
    if (!this->inputsGet_out(0, inputs)) {
        adcs_cycle_step(&this->m_cycle, NULL);
        this->drive();
        this->log_WARNING_HI_InputsMissing(this->m_cycle.missed);
        this->writeTelemetry();
        return;
    }
$copies    adcs_cycle_step(&this->m_cycle, &given);
    this->drive();
    this->report(given.t_s);
    this->writeTelemetry();
}

void Controller ::drive() {
    const F64* const dipole = this->m_cycle.driven_dipole_a_m2;
    const F64* const torque = this->m_cycle.command.torque_n_m;
    this->actuate_out(0, Actuation(F64x3(dipole[0], dipole[1], dipole[2]), F64x3(torque[0], torque[1], torque[2])));
}

void Controller ::report(F64 t_s) {
    const U32 risen = this->m_cycle.risen;
    if ((risen & ADCS_MET_LAW_FAILED) != 0U) {
        int64_t line = 0;
        const int64_t blocks = adcs_failures(&this->m_cycle.state, &line);
        this->log_WARNING_HI_LawFailed(blocks, line);
    }
$met_reports}

void Controller ::writeTelemetry() {
    const adcs_state* const state = &this->m_cycle.state;
    const adcs_command& command = this->m_cycle.command;
    const F64* const dipole = command.dipole_a_m2;
    const F64* const torque = command.torque_n_m;
    const adcs_estimate estimate = adcs_estimated(state);
    const F64* const q = estimate.q_body_to_inertial;
    const F64* const omega = estimate.omega_body_rad_s;
    const F64* const bias = estimate.gyro_bias_rad_s;
    int64_t line = 0;
    this->tlmWrite_Steps(this->m_cycle.steps);
    this->tlmWrite_Missed(this->m_cycle.missed);
    this->tlmWrite_Met(this->m_cycle.met);
    this->tlmWrite_Failures(adcs_failures(state, &line));
    this->tlmWrite_Dipole(F64x3(dipole[0], dipole[1], dipole[2]));
    this->tlmWrite_Torque(F64x3(torque[0], torque[1], torque[2]));
    this->tlmWrite_EstimateTime(estimate.t_s);
    this->tlmWrite_Attitude(F64x4(q[0], q[1], q[2], q[3]));
    this->tlmWrite_Rate(F64x3(omega[0], omega[1], omega[2]));
    this->tlmWrite_GyroBias(F64x3(bias[0], bias[1], bias[2]));
    this->tlmWrite_AttitudeSigma(estimate.sigma_rad);
    this->tlmWrite_RateSigma(estimate.sigma_rad_s);
$mode_reports}

void Controller ::answer(FwOpcodeType opCode, U32 cmdSeq, adcs_outcome outcome) {
    if (outcome == ADCS_DONE) {
        this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::OK);
        return;
    }
    this->log_WARNING_HI_CommandRefused(Outcome(static_cast<Outcome::T>(outcome)));
    this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::VALIDATION_ERROR);
}

void Controller ::REBASE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 shift_s) {
    this->answer(opCode, cmdSeq, adcs_rebase(&this->m_cycle.state, shift_s));
}

void Controller ::RESTART_ESTIMATORS_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) {
    this->answer(opCode, cmdSeq, adcs_restart_estimators(&this->m_cycle.state));
}

void Controller ::CLEAR_EVENT_THROTTLE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) {
    this->log_WARNING_HI_InputsMissing_ThrottleClear();
    this->log_WARNING_HI_LawFailed_ThrottleClear();
$met_clears    this->answer(opCode, cmdSeq, ADCS_DONE);
}

$definitions${parameter_definitions}void Controller ::applyParameters() {
    Fw::ParamValid valid = Fw::ParamValid::UNINIT;
$applies}

void Controller ::setParameter(int32_t place, F64 value) {
    if (adcs_parameter(&this->m_cycle.state, place) == value) {
        return;
    }
    const adcs_outcome outcome = adcs_set_parameter(&this->m_cycle.state, place, value);
    if (outcome == ADCS_DONE) {
        this->log_ACTIVITY_HI_ParameterSet(place, adcs_parameter(&this->m_cycle.state, place));
    } else {
        this->log_WARNING_HI_ParameterRefused(place, value, Outcome(static_cast<Outcome::T>(outcome)));
    }
}

}  // namespace Adcs
