// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/overheard.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <utility>

#include "gateway/diagnosis/damage/changed_bytes.h"
#include "gateway/diagnosis/damage/examine.h"
#include "gateway/diagnosis/damage/words.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostUnasked = 256;
/// Messages that are further apart are two.
constexpr Duration kLongestPause = 2s;

/// With seven data bits and a parity each character has the same one; without it the eighth bit is
/// always 1.
bool HasParity(View heard) {
  const auto even =
      std::ranges::count_if(heard, [](auto byte) { return std::popcount(byte) % 2 == 0; });
  const auto size = std::ssize(heard);
  const bool mark = std::ranges::all_of(heard, [](auto byte) { return byte > 0x7F; });
  return mark || 8 * std::max(even, size - even) >= 7 * size;
}

}  // namespace

Overheard::Overheard(const Device& device, const Roster& roster)
    : device_(device), roster_(roster), expect_(device.conversation->Listens()->expect) {}

std::optional<Finding> Overheard::Hear(View bytes, Instant now) {
  std::optional<Finding> before;
  if (now - last_ >= device_.conversation->Listens()->idle) {
    const bool torn = std::exchange(damaged_, false);
    if (torn) before = Look();
    torn_ = torn ? std::move(heard_) : Bytes();
    heard_.clear();
    before_ = std::exchange(pause_, now - last_);
  }
  last_ = now;
  Append(heard_, bytes.first(std::min(bytes.size(), kMostUnasked - heard_.size())));
  return before;
}

Finding Overheard::OnDamaged() {
  damaged_ = true;
  return Look();
}

/// With what came before the pause it is a whole message. Between two messages the silence is
/// longer.
bool Overheard::IsRest() const {
  if (torn_.empty() || pause_ > kLongestPause || 5 * pause_ > 4 * before_) return false;
  const Hearing hearing{
      .protocol = device_.protocol, .options = &device_.options, .expect = &expect_};
  Bytes whole = torn_;
  Append(whole, heard_);
  return !IsWhole(hearing, torn_) && IsWhole(hearing, whole);
}

Finding Overheard::Look() const {
  if (heard_.empty()) return {.symptom = Symptom::damaged};
  if (IsRest()) return {.symptom = Symptom::split, .time = pause_};
  const Hearing hearing{.protocol = device_.protocol,
                        .options = &device_.options,
                        .request = {},
                        .expect = &expect_,
                        .outcome = Outcome::corrupt,
                        .heard = heard_,
                        .arrivals = {},
                        .reply = {},
                        .gap = {},
                        .connection = roster_.is_network(),
                        .foreign = roster_.foreign()};
  Bytes cleared = heard_;
  for (std::uint8_t& byte : cleared) byte &= 0x7F;
  if (cleared != heard_ && IsWhole(hearing, cleared)) {
    if (HasParity(heard_)) return {.symptom = Symptom::eighth_bit};
    return {.symptom = Symptom::other_setting,
            .cause = "characters beyond ASCII come (" + Quote(heard_) + ")",
            .remedy = "let it send ASCII alone, without letters such as umlauts"};
  }
  Finding finding = Examine(hearing);
  const bool unsaid = finding.symptom == Symptom::odd && finding.cause.empty();
  if (unsaid || IsAnswered(finding.symptom)) finding.symptom = Symptom::damaged;
  return finding;
}

}  // namespace baudgate
