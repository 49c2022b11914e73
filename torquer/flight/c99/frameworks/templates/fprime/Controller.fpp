# The on-board computer of $name as a component of F Prime, exported by torquer $version.
module Adcs {

$arrays
$enums  @ What a control step is given: the latest readings with their times (adcs_inputs)
  struct Inputs {
$members  }

  @ What coils and wheels are to make until the next control step, body axes
  struct Actuation {
    dipole_a_m2: F64x3 @< dipole of the coils [A m^2], zero while sensors measure
    torque_n_m: F64x3 @< torque on the body by wheels [N m]
  }

  @ Have the inputs of a control step filled in; false: there are none
  port InputsGet(ref inputs: Inputs) -> bool

  @ Hand commands to the drivers
  port Actuate(actuation: Actuation)

  @ Estimators, modes and laws of the control step
  active component Controller {

    @ A tick of the control cycle, every ADCS_TICK_NS nanoseconds, by a rate group
    async input port schedIn: Svc.Sched

    @ The latest readings
    output port inputsGet: InputsGet

    @ To coils and wheels
    output port actuate: Actuate

    @ The clock from which times are handed in has been set forward
    async command REBASE(shift_s: F64) opcode 0

    @ Let the estimators begin again
    async command RESTART_ESTIMATORS() opcode 1

    @ Let events that were throttled out again
    async command CLEAR_EVENT_THROTTLE() opcode 2

$mode_commands    @ A command from the ground was not carried out
    event CommandRefused(why: Outcome) severity warning high id 0 format "not carried out: {}"

    @ A parameter keeps what it was: number of its place, what was sent
    event ParameterRefused(place: I32, value: F64, why: Outcome) \
      severity warning high id 1 format "parameter place {} keeps its value, {} refused: {}"

    @ A parameter has a new number, as read back
    event ParameterSet(place: I32, value: F64) \
      severity activity high id 2 format "parameter place {} is {}"

    @ A control step was due and had no inputs: nothing is commanded
    event InputsMissing(missed: U32) \
      severity warning high id 3 format "no inputs, {} times" throttle 10

    @ A law or an estimator of the scenario's own has failed: line in its file
    event LawFailed(blocks: I64, at_line: I64) \
      severity warning high id 4 format "bits {x} of ADCS_FAILED_..., line {}" throttle 10

$met_events    @ Control steps that were taken
    telemetry Steps: U32 id 0

    @ Control steps that had no inputs
    telemetry Missed: U32 id 1 update on change

    @ What the last step has met: bits ADCS_MET_...
    telemetry Met: U32 id 2 format "{x}"

    @ What has failed since the start: bits ADCS_FAILED_...
    telemetry Failures: I64 id 3 update on change

    @ Dipole that the laws command [A m^2], body axes
    telemetry Dipole: F64x3 id 4

    @ Torque on the body by wheels [N m], body axes
    telemetry Torque: F64x3 id 5

    @ When the estimate was made [s]
    telemetry EstimateTime: F64 id 6

    @ Estimated attitude, body to inertial (x, y, z, w)
    telemetry Attitude: F64x4 id 7

    @ Estimated rate, body axes [rad/s]
    telemetry Rate: F64x3 id 8

    @ Estimated bias of the gyros, body axes [rad/s]
    telemetry GyroBias: F64x3 id 9

    @ Standard deviation of the attitude [rad]
    telemetry AttitudeSigma: F64 id 10

    @ Standard deviation of the rate [rad/s]
    telemetry RateSigma: F64 id 11

$mode_channels$parameters    time get port timeCaller

    command reg port cmdRegOut

    command recv port cmdIn

    command resp port cmdResponseOut

    event port logOut

    text event port logTextOut

    telemetry port tlmOut
$parameter_ports
  }

}
