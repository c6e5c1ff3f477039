// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/event_block.h"

#include <algorithm>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/registers/block_words.h"

namespace baudgate::modbus {
namespace {

void PutEvent(EventBlock& block, std::size_t at, const events::EventRecord& event) {
  const Duration since = std::max(event.device_time.time_since_epoch(), Duration::zero());
  Put32(block, at, static_cast<std::uint32_t>(event.seq));
  Put32(block, at + 2, Saturated<std::uint32_t>(static_cast<std::uint64_t>(since / 1s)));
  block[at + 4] = static_cast<std::uint16_t>(since % 1s / 1ms);
  block[at + 5] = static_cast<std::uint16_t>(event.clock);
  block[at + 6] = Saturated<std::uint16_t>(event.channel);
  Put32(block, at + 7, event.code);
  block[at + 9] = static_cast<std::uint16_t>(event.state);
}

}  // namespace

EventBlock EventBlockOf(const events::EventFeed::Shown& shown, std::uint32_t first) {
  EventBlock block{};
  const std::size_t count = std::min(shown.events.size(), kShownEvents);
  Put32(block, 0, first);
  Put32(block, 2, static_cast<std::uint32_t>(shown.newest));
  Put32(block, 4, static_cast<std::uint32_t>(shown.oldest));
  Put32(block, 6, Saturated<std::uint32_t>(shown.lost));
  block[8] = static_cast<std::uint16_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    PutEvent(block, kEventHead + i * kEventRecord, shown.events[i]);
  }
  return block;
}

}  // namespace baudgate::modbus
