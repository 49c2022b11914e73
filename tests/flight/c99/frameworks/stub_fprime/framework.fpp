# A stub: the definitions of F Prime that the model of the component names.
type FwOpcodeType = U32
type FwChanIdType = U32
type FwEventIdType = U32
type FwPrmIdType = U32
type FwSizeType = U64
type FwSizeStoreType = U16
type FwIndexType = I16
type FwTimeBaseStoreType = U16
type FwTimeContextStoreType = U8
type FwQueueSizeType = U64
type FwEnumStoreType = I32
type FwPacketDescriptorType = U16
module Fw {
  type Time
  type CmdArgBuffer
  type LogBuffer
  type TextLogString
  type TlmBuffer
  type ParamBuffer
  enum CmdResponse : U8 { OK = 0, INVALID_OPCODE = 1, VALIDATION_ERROR = 2, FORMAT_ERROR = 3, EXECUTION_ERROR = 4, BUSY = 5 }
  enum LogSeverity : U8 { FATAL = 1, WARNING_HI = 2, WARNING_LO = 3, COMMAND = 4, ACTIVITY_HI = 5, ACTIVITY_LO = 6, DIAGNOSTIC = 7 }
  enum ParamValid : U8 { UNINIT = 0, VALID = 1, INVALID = 2, DEFAULT = 3 }
  port Time(ref $time: Fw.Time)
  port Cmd(opCode: FwOpcodeType, cmdSeq: U32, ref args: CmdArgBuffer)
  port CmdReg(opCode: FwOpcodeType)
  port CmdResponse(opCode: FwOpcodeType, cmdSeq: U32, ref response: CmdResponse)
  port Log($id: FwEventIdType, ref timeTag: Fw.Time, $severity: LogSeverity, ref args: LogBuffer)
  port LogText($id: FwEventIdType, ref timeTag: Fw.Time, $severity: LogSeverity, ref $text: TextLogString)
  port Tlm($id: FwChanIdType, ref timeTag: Fw.Time, ref val: TlmBuffer)
  port PrmGet($id: FwPrmIdType, ref val: ParamBuffer) -> ParamValid
  port PrmSet($id: FwPrmIdType, ref val: ParamBuffer)
}
module Svc {
  port Sched(context: U32)
}
