// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/ear.h"

#include <algorithm>
#include <utility>

namespace baudgate {
void Ear::Begin(const Standing& what, Instant now) {
  what_ = &what;
  assembler_.Begin(what.rule, what.expect);
  aligned_ = what.marked;
  damaged_ = false;
  last_byte_ = now;
}

std::optional<Instant> Ear::Deadline() const {
  if (!receiving()) return std::nullopt;
  return std::min(last_byte_ + what_->idle, TooLong());
}

Instant Ear::TooLong() const {
  return what_->whole > Duration::zero() ? began_ + what_->whole : Instant::max();
}

Heard Ear::OnBytes(View bytes, Instant now) {
  Heard heard = OnTimer(now);  // the timer may be late
  if (bytes.empty()) return heard;
  if (now - last_byte_ >= what_->idle) {
    aligned_ = true;
    damaged_ = false;
  }
  if (!receiving()) began_ = now;
  last_byte_ = now;
  assembler_.Feed(bytes);
  Take(heard, false, now);
  return heard;
}

Heard Ear::OnTimer(Instant now) {
  Heard heard;
  if (const auto deadline = Deadline(); deadline && *deadline <= now) End(heard, now);
  return heard;
}

void Ear::Take(Heard& heard, bool idle, Instant now) {
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
      Damage(heard, "the port was opened in the middle of it");
    }
  }
}

/// The parts of one damaged message count as one.
void Ear::Damage(Heard& heard, std::string_view why) {
  if (std::exchange(damaged_, true)) return;
  ++heard.damaged;
  heard.why = why;
}

void Ear::End(Heard& heard, Instant now) {
  if (last_byte_ + what_->idle <= TooLong()) {
    Take(heard, true, now);
    aligned_ = true;
    return;
  }
  Damage(heard, "longer under way than any message");
  assembler_.Begin(what_->rule, what_->expect);
  aligned_ = what_->marked;
}

}  // namespace baudgate
