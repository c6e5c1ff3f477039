// Where telegrams begin and end: one rule for every description.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/frame_rule.h"

namespace baudgate::protocols::telegram {

Cut CutTelegram(View held, const Expectation& expect, bool idle);

}  // namespace baudgate::protocols::telegram
