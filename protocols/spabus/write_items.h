// What one write request carries: one item with its value, or neighbouring items with theirs.
//   V150 ← 1                       >1WV150:1:
//   S21 ← 0.5, S22 ← 1.2, S23 ← 3  >1WS21/23:0.5/1.2/3:
// Points and values come from tasks; commands go to the conversation.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

/// What a write is for: the task's own value, then those that go with it.
std::vector<PointValue> ValuesOf(const Task& task);

/// The request that writes `values`, which CountTogether has passed, or one alone. An error names
/// the value that does not fit its point.
Result<Command> WriteOf(unsigned slave, std::span<const PointValue> values,
                        std::span<const config::Point> points);

/// How many of `writes`, from the first on, stand side by side in one channel and category, can be
/// read back, and fit one line; at most `most`, at least one.
std::size_t CountTogether(std::span<const PointValue> writes, std::span<const config::Point> points,
                          std::size_t most);

}  // namespace baudgate::protocols::spabus
