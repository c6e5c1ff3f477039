// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter_memory.h"

#include <fmt/format.h>

#include <algorithm>

#include "gateway/base/checksum.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::set4tm {
namespace {

using Seconds = std::chrono::seconds;

/// Eight bits of it: most other passwords have another mark, and many have the same.
std::uint8_t MarkOf(View password) { return static_cast<std::uint8_t>(Crc16(password) % 251); }

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  while (!(text = Trim(text)).empty()) {
    const auto end = std::min(text.find(' '), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

}  // namespace

MeterMemory::MeterMemory(View password) : mark_(MarkOf(password)) {}

void MeterMemory::Recall(std::string_view text, Now now) {
  clock_ = now;
  while (!text.empty()) {
    const auto end = std::min(text.find(';'), text.size());
    const auto words = Words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.size() == 2 && words[0] == "serial") {
      serial_ = ParseInteger<std::uint32_t>(words[1]);
    } else if (words.size() > 3 && words[0] == "password" && words[2] == "refused") {
      if (ParseInteger<unsigned>(words[1], 16) != mark_) continue;
      for (std::size_t i = 3; i < words.size() && !given_up(); ++i) {
        const auto at = ParseInteger<std::int64_t>(words[i]);
        if (!at) continue;
        // A clock that was set back must not make a try of long ago.
        const auto ago = now.wall - WallTime(Seconds(*at));
        refused_.push_back(now.instant - std::max<Duration>(ago, {}));
      }
    }
  }
  Write();
}

void MeterMemory::OnSerial(std::uint32_t serial) {
  serial_ = serial;
  Write();
}

void MeterMemory::OnEnabled() {
  serial_.reset();
  refused_.clear();
  Write();
}

bool MeterMemory::MayTry(Instant now) const {
  return refused_.empty() || (!given_up() && now - refused_.front() >= kSecondTry);
}

void MeterMemory::OnRefused(Instant now) {
  if (!given_up()) refused_.push_back(now);
  Write();
}

void MeterMemory::OnAccepted() {
  refused_.clear();
  Write();
}

Duration MeterMemory::Wait(Instant now) const {
  if (refused_.empty() || given_up()) return kSecondTry;
  return std::max<Duration>(refused_.front() + kSecondTry - now, {});
}

void MeterMemory::Write() {
  if (!clock_) return;
  text_ = serial_ ? fmt::format("serial {}", *serial_) : std::string();
  if (refused_.empty()) return;
  text_ += fmt::format("{}password {:02X} refused", text_.empty() ? "" : "; ", mark_);
  for (const Instant at : refused_) {
    const WallTime wall = clock_->wall + (at - clock_->instant);
    text_ +=
        fmt::format(" {}", std::chrono::duration_cast<Seconds>(wall.time_since_epoch()).count());
  }
}

}  // namespace baudgate::protocols::set4tm
