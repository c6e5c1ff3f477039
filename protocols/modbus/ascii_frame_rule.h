// Where Modbus ASCII messages begin and end in the bytes that protocols/assembler.h holds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::modbus {

/// Requests and, on a bus with several devices, their replies: they look alike.
Cut AsciiRequestRule(View held, const Expectation& expect, bool idle);
Cut AsciiReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::modbus
