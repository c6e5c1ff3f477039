// What every protocol's tests need between a conversation and its twin: values that the test sets,
// and a frame cut out of bytes as the engine does it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>

#include "gateway/line/assembler.h"
#include "protocols/twin.h"

namespace baudgate {

struct FixedValues final : TwinValues {
  std::map<std::size_t, Value> values;
  Value fallback;  ///< of points without one
  Value Get(std::size_t point, Instant) const override {
    const auto found = values.find(point);
    return found == values.end() ? fallback : found->second;
  }
  void Set(std::size_t point, const Value& value) override { values[point] = value; }
};

/// The first whole frame in bytes that silence follows; empty when there is none.
inline Bytes CutFrame(FrameRule rule, Expectation expect, View bytes) {
  Assembler assembler;
  assembler.Begin(rule, std::move(expect));
  assembler.Feed(bytes);
  if (auto frame = assembler.Next(false)) return *frame;
  return assembler.Next(true).value_or(Bytes());
}

}  // namespace baudgate
