// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/overheard.h"

#include <algorithm>
#include <utility>

#include "gateway/line/changed_bytes.h"
#include "gateway/line/examine.h"

namespace baudgate {
namespace {

constexpr std::size_t kMostHeard = 256;

}  // namespace

Overheard::Overheard(const Device& device, const Roster& roster)
    : device_(device), roster_(roster), expect_(device.conversation->Listens()->expect) {}

std::optional<Finding> Overheard::Hear(View bytes, Instant now) {
  std::optional<Finding> before;
  if (now - last_ >= device_.conversation->Listens()->idle) {
    if (std::exchange(damaged_, false)) before = Look();
    heard_.clear();
  }
  last_ = now;
  Append(heard_, bytes.first(std::min(bytes.size(), kMostHeard - heard_.size())));
  return before;
}

Finding Overheard::OnDamaged() {
  damaged_ = true;
  return Look();
}

Finding Overheard::Look() const {
  if (heard_.empty()) return {.symptom = Symptom::damaged};
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
  if (cleared != heard_ && IsWhole(hearing, cleared)) return {.symptom = Symptom::eighth_bit};
  Finding finding = Examine(hearing);
  const bool unsaid = finding.symptom == Symptom::odd && finding.cause.empty();
  if (unsaid || IsAnswered(finding.symptom)) finding.symptom = Symptom::damaged;
  return finding;
}

}  // namespace baudgate
