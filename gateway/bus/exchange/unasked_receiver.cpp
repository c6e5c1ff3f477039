// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/unasked_receiver.h"

#include <algorithm>
#include <utility>

namespace baudgate {

void UnaskedReceiver::Begin(Instant now) {
  assembler_.Begin(what_.rule, what_.expect);
  aligned_ = what_.marked;
  damaged_ = false;
  torn_until_ = {};
  last_byte_ = now;
}

std::optional<Instant> UnaskedReceiver::Deadline() const {
  if (!receiving()) return std::nullopt;
  return std::min(last_byte_ + what_.idle, TooLong());
}

Instant UnaskedReceiver::TooLong() const {
  return what_.whole > Duration::zero() ? began_ + what_.whole : Instant::max();
}

UnaskedInput UnaskedReceiver::OnBytes(View bytes, Instant now) {
  UnaskedInput heard = OnTimer(now);  // the timer may be late
  if (bytes.empty()) return heard;
  if (now - last_byte_ >= what_.idle) {
    Align(now);
    damaged_ = false;
  }
  if (!receiving()) began_ = now;
  last_byte_ = now;
  assembler_.Feed(bytes);
  Take(heard, false, now);
  return heard;
}

UnaskedInput UnaskedReceiver::OnTimer(Instant now) {
  UnaskedInput heard;
  if (const auto deadline = Deadline(); deadline && *deadline <= now) End(heard, now);
  return heard;
}

void UnaskedReceiver::Take(UnaskedInput& heard, bool idle, Instant now) {
  for (;;) {
    auto message = assembler_.Next(idle, &heard.rest);
    const std::string_view why = assembler_.why();
    if (NeedsDrain(assembler_.TakeBlame())) Damage(heard, why);
    if (!message) return;
    began_ = now;
    if (std::exchange(aligned_, true)) {
      damaged_ = false;
      heard.messages.push_back({std::move(*message), now - last_byte_});
    } else {
      Damage(heard, torn_until_ == Instant() ? "the port was opened in the middle of it"
                                             : "it may be the rest of one that broke off");
    }
  }
}

/// Behind a silence.
void UnaskedReceiver::Align(Instant now) { aligned_ = now >= torn_until_; }

/// The parts of one damaged message count as one.
void UnaskedReceiver::Damage(UnaskedInput& heard, std::string_view why) {
  if (std::exchange(damaged_, true)) return;
  ++heard.damaged;
  heard.why = why;
}

void UnaskedReceiver::End(UnaskedInput& heard, Instant now) {
  if (last_byte_ + what_.idle <= TooLong()) {
    const bool could_go_on = !what_.marked && what_.whole > Duration::zero();
    Take(heard, true, now);
    if (heard.damaged > 0 && could_go_on) torn_until_ = TooLong();
    Align(now);
    return;
  }
  Damage(heard, "longer under way than any message");
  assembler_.Begin(what_.rule, what_.expect);
  aligned_ = what_.marked;
}

}  // namespace baudgate
