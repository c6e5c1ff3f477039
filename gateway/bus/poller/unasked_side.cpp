// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/unasked_side.h"

#include <cstddef>
#include <string>
#include <utility>

namespace baudgate {

void UnaskedSide::OnOpened() {
  first_ = true;
  if (const Device* const device = speaker_.device()) {
    ledger_.states.OnState(*device, "the port is open");
  }
}

void UnaskedSide::OnKept(const Device& device) {
  if (&device == speaker_.device()) speaker_.OnKept();
}

void UnaskedSide::OnSettled(Instant now) {
  if (speaker_.drained()) intake_.OnDrained(*speaker_.device(), now);
}

void UnaskedSide::OnBytes(View bytes, Instant now) {
  // Where a device is asked as well, its answer shows what the connection began with.
  const bool begins = std::exchange(first_, false) && speaker_.in_use();
  if (begins && is_network_ && observer_.IsNegotiation(bytes)) {
    ledger_.line.OnNegotiation();
    upkeep_.ShowLine(now);
  }
  if (const auto before = speaker_.Hear(bytes, now)) {
    ledger_.devices.OnMore(*speaker_.device(), *before);
  }
}

void UnaskedSide::OnInput(const UnaskedInput& heard, Now now) {
  if (!speaker_.in_use()) return;
  Device& device = *speaker_.device();
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    upkeep_.OnUnasked(device, Outcome::corrupt, std::string(heard.why), speaker_.OnDamaged(),
                      now.instant);
  }
  for (const UnaskedMessage& message : heard.messages) {
    Speaker::Said said = speaker_.OnMessage(message, now);
    upkeep_.OnUnasked(device, said.outcome, said.reason, speaker_.Look(said), now.instant);
    Take(std::move(said), now.instant);
  }
}

void UnaskedSide::OnTimer(Now now) {
  if (auto said = speaker_.OnTimer(now)) Take(std::move(*said), now.instant);
}

void UnaskedSide::Take(Speaker::Said said, Instant now) {
  Device& device = *speaker_.device();
  upkeep_.OnHeard(device, now);
  if (said.lost > 0) ledger_.devices.OnLostEvents(device, said.lost);
  intake_.TakeUnasked(device, std::move(said));
}

}  // namespace baudgate
