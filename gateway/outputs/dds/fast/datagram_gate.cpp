// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/datagram_gate.h"

#include <algorithm>
#include <utility>

namespace baudgate::dds {
namespace {

constexpr Duration kSilence = 10s;

std::string Line(Refusal reason, Sender sender, std::uint64_t folded) {
  return "refused " + std::string(Words(reason)) + " from " + Text(sender) + " (" +
         std::to_string(folded) + " more before)";
}

}  // namespace

DatagramGate::DatagramGate(const CheckOptions& options, Tell tell)
    : tell_(std::move(tell)), check_(options) {}

std::span<std::uint8_t> DatagramGate::LetIn(std::span<std::uint8_t> datagram, Sender sender,
                                            Instant now) {
  const MutexLock lock(mutex_);
  const Verdict verdict = check_.Check(datagram, sender, now);
  if (!verdict.passes()) {
    ++counters_.refused[static_cast<std::size_t>(verdict.reason)];
    Fold(verdict.reason, sender, now);
    return {};
  }
  ++counters_.passed;
  for (std::size_t i = 0; i < verdict.edit_count; ++i) {
    std::ranges::copy(verdict.edits[i].bytes, datagram.subspan(verdict.edits[i].at).begin());
  }
  for (std::size_t i = 0; i < verdict.hidden_count; ++i) {
    datagram[verdict.hidden[i]] = datagram[verdict.hidden[i] + 1U] = 0;
  }
  return datagram.first(verdict.length);
}

DatagramCounters DatagramGate::counters() const {
  const MutexLock lock(mutex_);
  DatagramCounters counters = counters_;
  counters.participants = static_cast<std::uint32_t>(check_.participants().size());
  return counters;
}

DatagramGate::Known DatagramGate::known(Instant now) const {
  const MutexLock lock(mutex_);
  return {check_.participants().Reached(now), check_.participants().Unanswered(now)};
}

void DatagramGate::Fold(Refusal reason, Sender sender, Instant now) {
  if (now < silent_until_) {
    ++folded_;
    return;
  }
  silent_until_ = now + kSilence;
  if (tell_) tell_(Line(reason, sender, folded_));
  folded_ = 0;
}

}  // namespace baudgate::dds
