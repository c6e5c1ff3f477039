// `Observer` watches one line for the diagnosis in `baudgate status`. The bus calls it as a
// `LineObserver`; it has no influence on the bus. It collects the bytes between two requests and
// writes into the status of the device what the exchange looked like (a `Finding`). If more bytes
// come after the end of the exchange, it corrects the finding. `Overheard` does the same for a
// device that sends unasked. Memory is bounded. The rest of the diagnosis:
// gateway/bus/points/findings.h counts the findings, gateway/diagnosis/causes/diagnose.h makes
// sentences of the counts. Each part of Observer answers one question:
//
//   HeardExchange    which bytes came in this exchange?
//   ServerGreeting   which text did the server send before the first request?
//   EarlierReplies   do these bytes belong to an earlier request?
//                    (gateway/diagnosis/damage/earlier_replies.h)
//   ReplyHabits      what do the replies of this device look like in general?
//                    (gateway/diagnosis/damage/reply_habits.h, which also contains HeardExchange)
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "gateway/diagnosis/damage/earlier_replies.h"
#include "gateway/diagnosis/damage/examine.h"
#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate::diagnosis {

// `ServerGreeting` stores the bytes that come on a connection before the first request: the text of
// another service, a message that the server is in use, or Telnet. While no device answers, the
// greeting may explain why. Examples:
//
//   opened, "Login: ", a request, silence     the greeting explains the silence
//   opened, a request, "Login: "              as above: the greeting may arrive after the request
//   opened, "Login: ", a request, its reply   the greeting is dropped: the device answers
//
class ServerGreeting {
 public:
  void OnOpened() {
    first_ = true;
    text_.clear();
  }
  void Keep(View bytes) {
    Append(text_, bytes.first(std::min(bytes.size(), kMost - text_.size())));
  }
  /// Call when a device has answered. Returns the stored greeting and clears it. If there is no
  /// greeting and no exchange has ended on this connection, returns `heard`: all bytes of the
  /// present exchange.
  Bytes OnAnswered(View heard) {
    Bytes said = std::exchange(text_, {});
    if (said.empty() && first_) said.assign(heard.begin(), heard.end());
    return said;
  }
  /// Call at the end of every exchange, answered or not. `speaks`: the bytes in `heard` are
  /// readable text, or come from another service. In the first exchange these bytes are stored as
  /// greeting.
  void NoteExchange(View heard, bool speaks) {
    const bool first = std::exchange(first_, false);
    if (first && speaks && text_.empty()) text_.assign(heard.begin(), heard.end());
  }

  /// Returns the greeting; empty: no greeting came, or a device has answered since.
  const Bytes& text() const { return text_; }

 private:
  static constexpr std::size_t kMost = 1024;

  Bytes text_;
  bool first_ = true;  // no exchange has ended since the port was opened
};

// `Overheard` collects the bytes of a device that sends unasked, and finds out what unreadable
// messages looked like (gateway/diagnosis/damage/examine.h). Memory is bounded.
//
//   Hear(bytes)    for all bytes; if a new message begins after a damaged one, returns a finding
//                  about the damaged one
//   OnDamaged()    a message could not be read; returns a finding about its bytes so far
//
class Overheard {
 public:
  /// The references must stay valid for the lifetime of this object.
  Overheard(const bus::Device& device, const bus::Roster& roster);

  /// If `bytes` begin a new message and the message before was damaged, returns a finding about all
  /// bytes of the damaged message; else nothing.
  std::optional<Finding> Hear(View bytes, Instant now);
  Finding OnDamaged();
  /// The conversation has read a message, so the bytes that follow are not the rest of a damaged
  /// message.
  void OnRead() { damaged_ = false; }

 private:
  Finding Look() const;
  bool IsRest() const;

  const bus::Device& device_;
  const bus::Roster& roster_;
  const protocols::Expectation expect_;
  Bytes heard_;  // bytes since the last silence
  Bytes torn_;   // bytes of the message before the last silence, if it was damaged
  Instant last_{};
  Duration pause_{};   // silence between torn_ and heard_
  Duration before_{};  // silence before torn_
  bool damaged_ = false;
};

class Observer : public bus::LineObserver {
 public:
  /// The references must stay valid for the lifetime of this object.
  Observer(const bus::Roster& roster, bus::PointStore& store);
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  void OnOpened() override {
    exchange_.OnOpened();
    greeting_.OnOpened();
  }
  void OnRequest(const bus::Member& member, const protocols::Request& request,
                 Instant now) override;
  void Hear(View bytes, Instant now) override;
  void OnReply(View frame) override { exchange_.Take(frame); }
  void OnExchange(const bus::EndedExchange& ended, Now now) override;
  bool TakeNegotiation() override { return std::exchange(negotiated_, false); }
  void OnPoll(const bus::Device& device, std::size_t query) override;

  void OnUnaskedBytes(View bytes, Instant now) override;
  bool IsNegotiation(View bytes) const override;
  void OnUnasked(const bus::Device& device, Outcome outcome, const std::string& reason,
                 const std::string& remedy, Duration rest, Instant now) override;

  // Ends the exchange and returns what it looked like on the wire. TakeFinding and TakeChanged do
  // the work of OnExchange and OnRequest without writing to the status; they are public for tests.
  Finding TakeFinding(Outcome outcome);
  /// Returns the exchanges whose finding has changed, because more bytes came later; each exchange
  /// once.
  std::vector<EarlierFinding> TakeChanged();

 private:
  struct Last {
    Symptom symptom = Symptom::clean;
    std::uint8_t asked = 0;  // which of kSpecialBytes the request contained, one bit each
  };

  static void Complete(const bus::EndedExchange& ended, Finding& finding);
  void Amend(const bus::Member& member, const Finding& finding, std::size_t back);
  std::optional<Finding> More();
  void OnAnswered();
  Finding Look();
  Finding LookAgain(Finding finding);
  Finding Greet(Finding finding);

  const bus::Roster& roster_;
  bus::PointStore& store_;
  bus::ByMember<Last> last_;
  HeardExchange exchange_;  // the present exchange, or the last one
  ServerGreeting greeting_;
  ReplyHabits habits_;
  EarlierReplies earlier_{habits_};
  Symptom told_ = Symptom::clean;
  bool negotiated_ = false;
  std::optional<Overheard> overheard_;  // empty: no device of the line sends unasked
};

/// Makes the observer of a line, for Poller. The references must stay valid for its lifetime.
std::unique_ptr<bus::LineObserver> Observe(const bus::Roster& roster, bus::PointStore& store);

}  // namespace baudgate::diagnosis
