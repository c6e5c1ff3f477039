// Where Modbus TCP messages begin and end in the bytes that protocols/assembler.h holds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::modbus {

Cut TcpRequestRule(View held, const Expectation& expect, bool idle);
Cut TcpReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::modbus
