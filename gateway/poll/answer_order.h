// To which of the latest requests an answer may belong. Replies of these protocols carry no number:
// a device (or a serial server before it) that once owes an answer may from then on answer every
// request with the reply to an earlier one, each good in itself. This keeps the lags that are
// possible, from what was answered and what was not, and says whether a request may be sent so that
// a shifted answer can not pass for its own. One for each device, which may lag by itself, and one
// for the line, because a serial server before it delays whatever comes. Knows requests by
// fingerprint only; gateway/poll/poller.cpp asks.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace baudgate {

class AnswerOrder {
 public:
  using Fingerprint = std::size_t;
  /// Of a device's probe: its answer looks like no other. Odd; those of other requests are even.
  static constexpr Fingerprint Probe(std::size_t device) { return 2 * device + 1; }
  /// Of all devices whose probes are answered alike.
  static constexpr Fingerprint kNamelessProbe = ~Fingerprint{0};
  static constexpr bool IsProbe(Fingerprint request) { return (request & 1U) != 0; }

  void OnSent(Fingerprint request);
  /// The latest request had no answer: it may still come.
  void OnSilence();
  /// The latest request was answered: with the answer to this probe of its device, or with another.
  void OnAnswer(Fingerprint probe, bool looks_like_probe);

  /// Whether the latest answer may be that to the latest request.
  bool MayBeInStep() const { return (possible_ & 1U) != 0; }
  /// Nothing else is possible.
  bool IsInStep() const { return possible_ == 1; }
  /// Whether a shifted answer to `request`, sent next, would be found out or be the same request's.
  bool IsSafe(Fingerprint request) const;

 private:
  static constexpr std::size_t kMostLag = 31;

  Fingerprint SentBefore(std::size_t requests) const {
    return sent_[(count_ - requests) % sent_.size()];
  }

  std::array<Fingerprint, kMostLag + 1> sent_{};
  std::size_t count_ = kMostLag;  // of requests; the latest is sent_[count_ % size]
  std::uint32_t possible_ = 1;    // bit n: answers may lag n requests behind
};

}  // namespace baudgate
