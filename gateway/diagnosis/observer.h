// Watches a line for the status: keeps what comes between one request and the next, and writes into
// the status of the device what the exchange looked like, also when more has come after its end.
// Overheard does the same for the device that sends unasked. Start here to read the diagnosis:
// findings are counted in gateway/bus/points/findings.h, and gateway/diagnosis/causes/diagnose.h
// makes sentences of them. Decides nothing on the bus, which calls it as `LineObserver`; which
// replies count is decided in gateway/bus/replies/whose_reply.h. Bounded memory. The parts of
// Observer have a question each:
//
//   HeardExchange    what came in this exchange?
//   ServerGreeting   what did the connection say before the first request?
//   EarlierReplies   whose earlier reply was that? (gateway/diagnosis/damage/earlier_replies.h)
//   ReplyHabits      what do the replies of this device look like in general?
//                    (gateway/diagnosis/damage/reply_habits.h, which has HeardExchange, too)
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

// Keeps what a connection says before anything is asked: another service, a word of a server that
// is in use, or Telnet. The greeting explains why no device answers, until one does.
//
//   opened, "Login: ", a request, silence     the greeting explains it
//   opened, a request, "Login: "              the same: a server's words may meet the first request
//   opened, "Login: ", a request, its reply   forgotten: it has kept nobody from answering
//
class ServerGreeting {
 public:
  void OnOpened() {
    first_ = true;
    text_.clear();
  }
  /// Bytes have come before the first request.
  void Keep(View bytes) {
    Append(text_, bytes.first(std::min(bytes.size(), kMost - text_.size())));
  }
  /// A device has answered. Returns what the connection had said until then; `heard`: with the
  /// reply.
  Bytes OnAnswered(View heard) {
    Bytes said = std::exchange(text_, {});
    if (said.empty() && first_) said.assign(heard.begin(), heard.end());
    return said;
  }
  /// An exchange has ended, whether answered or not. `speaks`: what was heard in it are words, or
  /// another service.
  void NoteExchange(View heard, bool speaks) {
    const bool first = std::exchange(first_, false);
    if (first && speaks && text_.empty()) text_.assign(heard.begin(), heard.end());
  }

  /// Empty: it has said nothing, or a device has answered since.
  const Bytes& text() const { return text_; }

 private:
  static constexpr std::size_t kMost = 1024;

  Bytes text_;
  bool first_ = true;  // no exchange has ended since the port was opened
};

// Bytes of a device that sends unasked which its conversation could not read: what they looked like
// (gateway/diagnosis/damage/examine.h). Bounded memory.
//
//   Hear(bytes)    at any time; returns what the bytes before looked like, if these begin new ones
//   OnDamaged()    what they look like so far
//
class Overheard {
 public:
  /// Both outlive it.
  Overheard(const bus::Device& device, const bus::Roster& roster);

  /// Empty: what came before was read, or looks as reported already.
  std::optional<Finding> Hear(View bytes, Instant now);
  Finding OnDamaged();
  /// The next message could be read, so it is not the rest of the damaged one.
  void OnRead() { damaged_ = false; }

 private:
  Finding Look() const;
  bool IsRest() const;

  const bus::Device& device_;
  const bus::Roster& roster_;
  const protocols::Expectation expect_;
  Bytes heard_;  // since the last silence
  Bytes torn_;   // before the last silence, if they were damaged
  Instant last_{};
  Duration pause_{};   // between these two
  Duration before_{};  // the silence before both
  bool damaged_ = false;
};

class Observer : public bus::LineObserver {
 public:
  /// Both must stay valid for the lifetime of this object.
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

  // The two halves of OnExchange and OnRequest, without the status; for tests.
  /// How the exchange looked on the wire.
  Finding TakeFinding(Outcome outcome);
  /// Exchanges that look different now, because more has come since they were looked at; each once.
  std::vector<EarlierFinding> TakeChanged();

 private:
  /// Of the last exchange of a member.
  struct Last {
    Symptom symptom = Symptom::clean;
    std::uint8_t asked = 0;  // the special bytes of its request
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
  HeardExchange exchange_;  // the last one
  ServerGreeting greeting_;
  ReplyHabits habits_;
  EarlierReplies earlier_{habits_};
  Symptom told_ = Symptom::clean;
  bool negotiated_ = false;
  std::optional<Overheard> overheard_;  // of the first device that sends unasked
};

/// For Poller.
std::unique_ptr<bus::LineObserver> Observe(const bus::Roster& roster, bus::PointStore& store);

}  // namespace baudgate::diagnosis
