// Where the messages of readers begin and end.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::reader {

/// Nobody asks a reader: a line of text, for twins that hear one anyway.
Cut RequestRule(View held, const Expectation& expect, bool idle);
Cut MessageRule(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::reader
