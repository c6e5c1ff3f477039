// Parses and prints events in the form of a relay: "12.345 0E1/12.410 0E3". The form is inferred in
// part (protocols/spabus/README.md), so text that does not fit is stored as text and never dropped.
//
//   "12.345 0E1"       {channel 0, code 1, 12.345 s of a minute}
//   "12.345 2E17 0.5"  {channel 2, code 17, …, "0.5"}
//   "12.345 0Q1 0.5"   {channel 0, code 0, …, "12.345 0Q1 0.5"}
//
// `EventSession` reads the events of a relay.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {

/// Codes of events that every relay can send, independent of its masks. After kRestarted the
/// relay's clock starts again, and its event register is empty.
inline constexpr std::uint32_t kRestarted = 50;
inline constexpr std::uint32_t kOverflow = 51;  ///< events after this event were lost

constexpr bool IsEventList(char category) { return category == 'L' || category == 'B'; }

/// Parses the data of a reply to L or B. Empty data gives no events.
std::vector<DeviceEvent> ParseEvents(std::string_view data);
/// True if the data can be that of a reply to L or B: it is empty, or each part is a time and a
/// letter with a number behind it.
bool LooksLikeEvents(std::string_view data);
/// Returns the text of an event as a relay sends it. `event.time` is within a minute; without a
/// time "00.000" is printed.
std::string PrintEvent(const DeviceEvent& event);

// EventSession reads the events of a relay: it decides the next request and handles its answer. L
// reads the next events and removes them from the relay, B reads the last answer to L again, C is
// the status.
//
//   after a start, and when the port opens     B, the status C, then L
//   L, answered with events                    done; L again when the events are on the disk
//   L, answered without events                 done: the relay has no more events
//   L, lost or damaged                         B until it is answered: L would remove the events
//                                              that the relay has just sent
//   L, answered with the last batch again      B, because the answer may be a late reply to an
//                                              earlier request; if B gives this batch, too, they
//                                              are new events with the same text
//   L, answered with events, where damage      B until two replies agree: else a wrong event could
//   may be undetected (recheck)                be stored, and the true one lost
//   L, refused                                 L at the next poll; a relay that has never answered
//                                              L, and refuses it three times, is not asked again
//   an answer whose sender is uncertain        B, as after a lost L
//   restarted (E50), overflow (E51)            C; a value other than 0 is cleared (WC:0), and all
//                                              points are read again
//
// The store of events decides whether a batch from B was stored before, because only the store
// remembers the batches from before a restart of the program (EventBatch::again).
class EventSession {
 public:
  /// `wanted`: true if the configuration asks for events. `rechecks`: true if damage can be
  /// undetected (option recheck), so that each batch is read a second time by B.
  EventSession(bool wanted, bool rechecks) : wanted_(wanted), rechecks_(rechecks) {}

  /// True if events are wanted, and the relay does not refuse L.
  bool has_events() const;
  /// Returns why no events come: L is refused, or kManyFailures requests have failed in a row; else
  /// no trouble.
  const DeviceTrouble& remark() const;

  Command Next(unsigned slave);
  /// Returns the request that is sent in place of a failed L.
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

  /// A batch that must be read a second time before it is reported.
  struct Held {
    std::string said;
    bool again = false;
  };

  const bool wanted_;
  const bool rechecks_;
  bool answers_ = false;  ///< true: the relay has answered L since the port was opened
  int refusals_ = 0;      ///< how many refusals of L came in a row
  int failures_ = 0;      ///< how many steps have failed in a row
  Step step_ = Step::none;
  bool owes_backup_ = true;  ///< true: B must be sent before L
  bool owes_status_ = true;
  bool clears_ = false;
  int silent_backups_ = 0;  ///< how many times in a row B got no answer
  /// True: the relay has not refused B, nor ignored it kSilentBackups times.
  bool knows_backup_ = true;
  bool answers_backup_ = false;  ///< true: the relay has answered B since the program started
  std::optional<Held> held_;
  std::string last_;
  Instant last_at_{};
};

}  // namespace baudgate::protocols::spabus
