// Which of the latest requests was answered last, as far as that can be known. Replies of these
// protocols carry no number, but they come in the order of their requests, each once:
//
//   ?A1   no reply        it is lost, or still owed
//   ?A2   a reply         to ?A2, or to ?A1 while that to ?A2 is still owed
//   ?A2   a reply         whichever was answered before, this one is to a ?A2
//
// There is one for each device, which may lag by itself, and one for the line, because a serial
// server in front of it delays all replies. Used by gateway/bus/replies/whose_reply.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate {

struct SentRequest {
  std::size_t place = kNobody;  ///< in the roster: the member it went to
  Bytes bytes;                  ///< see Asked::question
  Instant at{};
  bool proof = false;  ///< its reply differs from those to all polls of the device
  Bytes context{};     ///< see Request

  static constexpr std::size_t kNobody = ~std::size_t{0};  ///< none was sent
  static constexpr std::size_t kStranger = kNobody - 1;    ///< another master's, of unknown content
};

class AnswerOrder {
 public:
  /// The most requests whose replies may be owed; older ones are given up.
  static constexpr std::size_t kMostOwed = 63;
  /// The most replies that another master is owed.
  static constexpr std::size_t kMostOfStrangers = 3;

  void OnSent(const SentRequest& request);
  /// Up to three replies to requests of another master may still come, and any reply may be one of
  /// them. Three in all, however often a port is opened before anything is answered.
  void OnStranger(Instant now);
  /// No other master has asked.
  void ForgetStrangers();
  /// Whether a reply may answer this request, which was sent so many `before` the latest.
  using MayAnswer = std::function<bool(const SentRequest&, std::size_t before)>;
  /// A reply came. `fits`: it may answer the latest request. False: it answers none of those that
  /// are owed a reply, and nothing has changed.
  bool OnAnswer(bool fits, const MayAnswer& may_answer);
  /// Since a proof was answered, nothing but the latest request was sent, perhaps several times. So
  /// nothing is owed, and of all earlier replies only that to the proof may come again.
  bool IsBehindProof() const;
  /// Behind a proof, a reply fits neither: the device answers the latest request in another form,
  /// or somebody else has answered.
  void OnOddForm() { answered_ |= 1; }
  /// A reply came that answers nothing that is owed: the order is lost. Any earlier request may
  /// have been answered last, and only a reply that can belong to few of them shows which one.
  void OnLost();
  /// Whether an earlier request may have this reply, even if nothing seems to be owed.
  bool MayBeEarlier(const MayAnswer& may_answer) const;
  /// A reply has come twice, so one more than before may be owed.
  void OnCopy();
  /// Nothing is owed.
  void Reset() { answered_ = 1; }
  /// If the latest request was sent before this time, no reply is expected any more.
  void ForgetBefore(Instant time) {
    if (SentBefore(0).at < time) Reset();
  }

  /// How many of the latest requests may still be answered.
  std::size_t Owed() const { return static_cast<std::size_t>(std::bit_width(answered_)) - 1; }
  /// Whether one of these is among them.
  bool Owes(const std::function<bool(const SentRequest&)>& is_one) const;
  /// Nothing is owed: the latest request was answered last.
  bool IsInStep() const { return answered_ == 1; }
  bool MayBeInStep() const { return (answered_ & 1U) != 0; }
  /// Whether an owed reply would be recognised, whatever is sent next: all that are owed answer
  /// proofs.
  bool IsSafe() const;
  /// Whether the latest reply is certain to answer `request`, the bytes of the latest request:
  /// every request that the reply may answer has these bytes and the same context.
  bool IsAnswerTo(const Bytes& request) const;
  /// Whether the latest reply can only belong to the latest request and to those of the same bytes
  /// directly before it.
  bool IsOfLatest() const;
  /// How much earlier than the latest request the oldest one was sent to which the reply may
  /// belong.
  Duration Older() const { return SentBefore(0).at - SentBefore(Owed()).at; }

 private:
  std::uint64_t Fitting(std::size_t nearest, std::size_t end, const MayAnswer& may_answer) const;
  const SentRequest& SentBefore(std::size_t requests) const {
    return sent_[(count_ - requests) % sent_.size()];
  }
  /// It asks the same as the latest one.
  bool IsSame(std::size_t lag) const {
    const SentRequest& latest = SentBefore(0);
    return SentBefore(lag).bytes == latest.bytes && SentBefore(lag).context == latest.context;
  }

  std::array<SentRequest, kMostOwed + 1> sent_{};
  std::size_t count_ = kMostOwed;  // of requests; the latest is sent_[count_ % size]
  std::uint64_t answered_ = 1;  // bit n: the request n before the latest may be the last answered
};

}  // namespace baudgate
