// Where Modbus RTU messages begin and end in the bytes that protocols/assembler.h holds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::modbus {

Cut RtuRequestRule(View held, const Expectation& expect, bool idle);
Cut RtuReplyRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::modbus
