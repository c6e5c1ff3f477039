// `Observer` watches one line for `baudgate status`. The bus calls it as a `LineObserver`; it
// decides nothing on the bus. It collects the bytes between two requests and writes into the status
// of the device what the exchange looked like; if more bytes come after the end of an exchange, it
// corrects the entry. `Overheard` does the same for a device that sends unasked. Memory is bounded.
// Start here to read the diagnosis: gateway/bus/points/findings.h counts the findings, and
// gateway/diagnosis/causes/diagnose.h makes sentences of the counts.
// gateway/bus/replies/whose_reply.h decides which replies count. Each part of Observer answers one
// question:
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

// ServerGreeting stores the bytes that come on a connection before the first request: the text of
// another service, a message that the server is in use, or Telnet. Until a device answers, the
// greeting explains why no device does.
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
  /// Stores bytes that came before the first request.
  void Keep(View bytes) {
    Append(text_, bytes.first(std::min(bytes.size(), kMost - text_.size())));
  }
  /// Call this when a device has answered. Returns the stored greeting and clears it. If there is
  /// no greeting and this was the first exchange, returns `heard`: all bytes of the exchange,
  /// including the reply.
  Bytes OnAnswered(View heard) {
    Bytes said = std::exchange(text_, {});
    if (said.empty() && first_) said.assign(heard.begin(), heard.end());
    return said;
  }
  /// Call this at the end of every exchange, answered or not. `speaks`: the bytes in `heard` are
  /// text for people, or come from another service.
  void NoteExchange(View heard, bool speaks) {
    const bool first = std::exchange(first_, false);
    if (first && speaks && text_.empty()) text_.assign(heard.begin(), heard.end());
  }

  /// Empty: no greeting came, or a device has answered since.
  const Bytes& text() const { return text_; }

 private:
  static constexpr std::size_t kMost = 1024;

  Bytes text_;
  bool first_ = true;  // no exchange has ended since the port was opened
};

// Overheard collects the bytes of a device that sends unasked and finds out what unreadable
// messages looked like (gateway/diagnosis/damage/examine.h). Memory is bounded.
//
//   Hear(bytes)    for all bytes; returns a finding if a new message begins after a damaged one
//   OnDamaged()    the conversation could not read the message: returns a finding so far
//
class Overheard {
 public:
  /// The references must stay valid for the lifetime of this object.
  Overheard(const bus::Device& device, const bus::Roster& roster);

  /// If `bytes` begin a new message and the message before was damaged, returns what that message
  /// looked like in full. Otherwise returns nothing.
  std::optional<Finding> Hear(View bytes, Instant now);
  Finding OnDamaged();
  /// The conversation has read a message, so the next bytes are not the rest of a damaged message.
  void OnRead() { damaged_ = false; }

 private:
  Finding Look() const;
  bool IsRest() const;

  const bus::Device& device_;
  const bus::Roster& roster_;
  const protocols::Expectation expect_;
  Bytes heard_;  // bytes since the last silence
  Bytes torn_;   // the message before the last silence, if it was damaged
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

  // OnExchange and OnRequest without the update of the status; for tests.
  /// Ends the exchange and returns what it looked like on the wire.
  Finding TakeFinding(Outcome outcome);
  /// Returns the exchanges whose finding has changed because more bytes came later; each once.
  std::vector<EarlierFinding> TakeChanged();

 private:
  struct Last {
    Symptom symptom = Symptom::clean;
    std::uint8_t asked = 0;  // which of kSpecialBytes the request had, one bit each
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
  HeardExchange exchange_;  // the current exchange, or the last one
  ServerGreeting greeting_;
  ReplyHabits habits_;
  EarlierReplies earlier_{habits_};
  Symptom told_ = Symptom::clean;
  bool negotiated_ = false;
  std::optional<Overheard> overheard_;  // for the first device that sends unasked
};

/// Makes the observer of a line, for Poller. The references must outlive the observer.
std::unique_ptr<bus::LineObserver> Observe(const bus::Roster& roster, bus::PointStore& store);

}  // namespace baudgate::diagnosis
