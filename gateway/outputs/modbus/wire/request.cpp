// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

ExceptionCode ParseRequest(View frame, ModbusRequest& request) {
  request.frame = frame;
  request.unit = UnitOf(frame);
  return ParseRequest(PduOf(frame), static_cast<PlainRequest&>(request));
}

std::size_t ReplySize(const ModbusRequest& request) {
  return kMbapHeader + AwaitedLength(PduOf(request.frame)).value_or(0);
}

std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code) {
  const auto function = static_cast<std::uint8_t>(FunctionOf(frame) | kExceptionBit);
  return {frame[0], frame[1], 0, 0, 0, 3, UnitOf(frame), function, code};
}

}  // namespace baudgate::modbus
