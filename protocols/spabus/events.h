// Parses and prints events in the form of a relay: "12.345 0E1/12.410 0E3". The form is inferred in
// part (README.md), so text that does not fit is stored as text and never dropped.
//
//   "12.345 0E1"       {channel 0, code 1, 12.345 s of a minute}
//   "12.345 2E17 0.5"  {channel 2, code 17, …, "0.5"}
//   "12.345 0Q1 0.5"   {channel 0, code 0, …, "12.345 0Q1 0.5"}
//
// `EventSession` takes the events out of a relay.
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

/// Events that every relay has, independent of its masks. At kRestarted the relay's clock starts
/// again, and its register is empty.
inline constexpr std::uint32_t kRestarted = 50;
inline constexpr std::uint32_t kOverflow = 51;  ///< events after this event are lost

constexpr bool IsEventList(char category) { return category == 'L' || category == 'B'; }

/// Parses the data of a reply to L or B. Returns no events for empty data.
std::vector<DeviceEvent> ParseEvents(std::string_view data);
/// True if the data may come from a reply to L or B: empty, or each part is a time and a letter
/// with a number behind it.
bool LooksLikeEvents(std::string_view data);
/// `event.time` is within a minute; without it "00.000" is printed.
std::string PrintEvent(const DeviceEvent& event);

// Takes the events out of a relay: decides the next request and handles its answer.
//
//   after a start, and when the port opens     B, the status C, then L
//   L, answered with events                    done; L again when the events are on the disk
//   L, answered without events                 done: the relay has no more events
//   L, lost or damaged                         B until it is answered: L would remove the events
//                                              that the relay has just sent
//   L, answered with the last batch again      B: maybe a late reply to an earlier request; if B
//                                              gives the batch, too, they are new events with the
//                                              same text
//   L, answered with events, where damage      B until two replies agree: else a wrong event could
//   may be undetected (recheck)                be stored, and the true one lost
//   L, refused                                 L at the next poll; a relay that has never answered
//                                              L, and refuses it three times, is not asked again
//   a batch whose sender is uncertain          B, as after a lost L
//   restarted (E50), overflow (E51)            C; a value other than 0 is cleared (WC:0), and all
//                                              points are read again
//
// The store of events decides whether a batch from B is old, because only the store has the batches
// from before a restart (EventBatch::again).
class EventSession {
 public:
  /// `wanted`: the configuration asks for events. `rechecks`: a damaged reply may look undamaged.
  EventSession(bool wanted, bool rechecks) : wanted_(wanted), rechecks_(rechecks) {}

  /// True if events are wanted, and the relay does not refuse L.
  bool has_events() const;
  /// Returns why no events come, if this lasts.
  const DeviceTrouble& remark() const;

  Command Next(unsigned slave);
  /// Returns the request that replaces a failed L.
  Command Instead(unsigned slave);

  Answer OnAnswer(Exchange exchange, Instant now);
  Then OnFailure(Outcome outcome);
  /// Forgets what was learned: another relay may be connected now, or another master may have taken
  /// events.
  void OnReconnect();

 private:
  enum class Step : std::uint8_t { none, events, backup, status, clear };

  Answer OnEvents(Exchange exchange, bool again, Instant now);
  Answer Hold(std::string said, bool again);
  Answer Report(EventBatch batch, Instant now);
  Answer ReportHeld(Instant now);
  Answer OnStatus(const Exchange& exchange, Instant now);
  Answer OnRefused(Step step, Exchange exchange, Instant now);

  /// A batch that must come a second time before it counts.
  struct Held {
    std::string said;
    bool again = false;  ///< EventBatch::again
  };

  const bool wanted_;
  const bool rechecks_;
  bool answers_ = false;  ///< the relay has answered L since the port was opened
  int refusals_ = 0;      ///< refusals of L in a row
  int failures_ = 0;      ///< failures of any step in a row
  Step step_ = Step::none;
  bool owes_backup_ = true;  ///< B must be sent before L
  bool owes_status_ = true;
  bool clears_ = false;
  int silent_backups_ = 0;       ///< B without an answer, in a row
  bool knows_backup_ = true;     ///< B was not refused, and not ignored kSilentBackups times
  bool answers_backup_ = false;  ///< the relay has answered B since the program started
  std::optional<Held> held_;
  std::string last_;
  Instant last_at_{};
};

}  // namespace baudgate::protocols::spabus
