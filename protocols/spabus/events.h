// Events as a relay prints them, and back: "12.345 0E1/12.410 0E3". What relays really print is
// inferred in part (README.md), so what does not fit is kept as text and never dropped.
//
//   "12.345 0E1"       {channel 0, code 1, 12.345 s of a minute}
//   "12.345 2E17 0.5"  {channel 2, code 17, …, "0.5"}
//   "12.345 0Q1 0.5"   {channel 0, code 0, …, "12.345 0Q1 0.5"}
//
// EventSession takes the events out of a relay.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

/// Events that every relay has, whatever its masks say.
inline constexpr std::uint32_t kRestarted = 50;  ///< its clock starts again, its register is empty
inline constexpr std::uint32_t kOverflow = 51;   ///< what came after it is lost

/// L and B.
constexpr bool IsEventList(char category) { return category == 'L' || category == 'B'; }

/// The data of a reply to L or B. Empty data: none.
std::vector<DeviceEvent> ParseEvents(std::string_view data);
/// Whether the data can be that of a reply to L or B, and not of another: empty, or each part a
/// time and a letter with a number behind it.
bool LooksLikeEvents(std::string_view data);
/// `event.time` is of a minute. Without it "00.000".
std::string PrintEvent(const DeviceEvent& event);

// The steps of taking events out of a relay: what is asked next, and what an answer leads to. Facts
// come from the conversation, commands go to it.
//
//   after a start, and when the port opens     B, the status C, then L
//   L, answered with events                    done; L again when they are kept
//   L, answered without                        done: the relay has nothing left
//   L, lost or damaged                         B, until it is answered: L would take away what the
//                                              relay has just given
//   L, answered with the last batch again      B: a late reply to an earlier request, maybe; if B
//                                              says it as well, these are new events that look
//                                              alike
//   L, answered with events, where damage      B, until two replies agree: a wrong event would be
//   may look whole (recheck)                   kept, and the true one lost
//   L, refused                                 L at the next poll; a relay that has never answered
//                                              one, and refuses three, is not asked again
//   a batch that was not taken                 B, likewise
//   restarted (E50), overflow (E51)            C; what is not 0 is cleared (WC:0), and all points
//                                              are read again
//
// Whether a batch that B has brought is an old one is for the store of events to say, which also
// knows what was kept before a restart (EventBatch::again).
class EventSession {
 public:
  /// `wanted`: the configuration asks for events. `rechecks`: a damaged reply may look whole.
  EventSession(bool wanted, bool rechecks) : wanted_(wanted), rechecks_(rechecks) {}

  /// They are wanted, and the relay knows L, as far as is known.
  bool has_events() const;
  /// Why none come, if that lasts.
  const DeviceTrouble& remark() const;

  Command Next(unsigned slave);
  /// In place of L, which has failed.
  Command Instead(unsigned slave);

  Answer OnAnswer(Exchange exchange, Instant now);
  Then OnFailure(Outcome outcome);
  /// Another relay may hang there now, or another master may have asked this one.
  void OnReconnect();

 private:
  enum class Step : std::uint8_t { none, events, backup, status, clear };

  Answer OnEvents(Exchange exchange, bool again, Instant now);
  Answer Hold(std::string said, bool again);
  Answer Report(EventBatch batch, Instant now);
  Answer ReportHeld(Instant now);
  Answer OnStatus(const Exchange& exchange, Instant now);
  Answer OnRefused(Step step, Exchange exchange, Instant now);

  /// What has been said, and has to be said once more before it counts.
  struct Held {
    std::string said;
    bool again = false;  ///< EventBatch::again
  };

  const bool wanted_;
  const bool rechecks_;
  bool answers_ = false;  ///< L, since the port has opened
  int refusals_ = 0;      ///< of L in a row
  int failures_ = 0;      ///< of any step in a row
  Step step_ = Step::none;
  bool owes_backup_ = true;  ///< B before L
  bool owes_status_ = true;
  bool clears_ = false;
  int silent_backups_ = 0;       ///< in a row
  bool knows_backup_ = true;     ///< not refused, nor silent to all of them
  bool answers_backup_ = false;  ///< it has, since the program began
  std::optional<Held> held_;
  std::string last_;  ///< the last batch, as it was said
  Instant last_at_{};
};

}  // namespace baudgate::protocols::spabus
