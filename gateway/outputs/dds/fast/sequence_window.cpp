// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/sequence_window.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

// 512 sets of four: of the writers that share a set, the one that was heard longest ago gives way.
constexpr std::size_t kSets = 512;
constexpr std::size_t kWays = 4;

std::size_t SetOf(const Guid& guid) {
  std::uint32_t hash = 2166136261;
  for (const std::uint8_t byte : guid) hash = (hash ^ byte) * 16777619;
  return (hash ^ (hash >> 16)) % kSets;
}

/// Entities of discovery have 0xC… as their kind (RTPS 2.3, 9.3.1.2).
bool IsBuiltIn(const Guid& guid) { return (guid.back() & 0xC0) == 0xC0; }

}  // namespace

SequenceWindow::SequenceWindow(const WindowLimits& limits)
    : limits_(limits), writers_(kSets * kWays), purse_(limits.burst) {}

bool SequenceWindow::Advance(const Guid& guid, std::int64_t to, std::int64_t skipped, Instant now) {
  Writer& writer = Find(guid);
  const bool is_new = writer.guid != guid;
  const std::int64_t told = is_new ? 0 : writer.told;
  if (is_new && !IsBuiltIn(guid)) {
    if (to > limits_.first_of_samples) return false;
  } else if (!Pay(std::max({to - told, skipped, std::int64_t{0}}), now)) {
    return false;
  }
  writer = {guid, std::max(told, to), now};
  return true;
}

/// The writer's place, or the one that it may take.
SequenceWindow::Writer& SequenceWindow::Find(const Guid& guid) {
  const auto set = writers_.begin() + static_cast<std::ptrdiff_t>(SetOf(guid) * kWays);
  const auto end = set + static_cast<std::ptrdiff_t>(kWays);
  const auto at = std::find_if(set, end, [&](const Writer& writer) { return writer.guid == guid; });
  if (at != end) return *at;
  return *std::min_element(set, end,
                           [](const Writer& a, const Writer& b) { return a.heard < b.heard; });
}

bool SequenceWindow::Pay(std::int64_t steps, Instant now) {
  if (steps == 0) return true;
  const auto passed = std::clamp<std::int64_t>((now - filled_) / 1ms, 0, 1'000'000);
  if (passed > 0) {
    purse_ = std::min(limits_.burst, purse_ + passed * limits_.each_second / 1000);
    filled_ = now;
  }
  if (steps > purse_) return false;
  purse_ -= steps;
  return true;
}

}  // namespace baudgate::dds
