// The device of a line that sends unasked: Speaker says what its messages mean, EventBacklog counts
// its events that are not on the disk yet, and UnaskedSide joins them with the line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/points/readings.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

class Intake;

// Events that are not on the disk yet, of a device that sends unasked. It cannot be made to wait,
// so the number of batches is bounded here: events beyond it are lost and counted.
//
//   Take() 1000 times, OnKept() never    true
//   Take()                               false: one is lost
//   OnKept(), Take()                     true; TakeLost(): 1, to be reported with this one
class EventBacklog {
 public:
  static constexpr std::size_t kMost = 1000;

  /// A batch of this many events is to be saved. False: there is no room for it.
  bool Take(std::size_t events) {
    if (waiting_ >= kMost) {
      lost_ += events;
      return false;
    }
    ++waiting_;
    return true;
  }
  /// A batch that was taken is on the disk.
  void OnKept() {
    if (waiting_ > 0) --waiting_;
  }
  /// How many were lost since the last call.
  std::size_t TakeLost() { return std::exchange(lost_, 0); }
  std::size_t waiting() const { return waiting_; }

 private:
  std::size_t waiting_ = 0;  // batches
  std::size_t lost_ = 0;     // events
};

// The device of a line that sends unasked: what its messages mean, and which of its events may wait
// for the disk (EventBacklog). Events beyond that are lost, which is
// reported with the next one that is saved:
//
//   1000 messages, the disk fails    1000 batches to be saved
//   3 more, of an event each         nothing to be saved; 3 lost, one warning
//   one is saved, then a message     to be saved: "3 events before this one lost: the disk failed"
class Speaker {
 public:
  /// For the device of this line that sends unasked.
  explicit Speaker(const Roster& roster) : device_(roster.Speaker()) {}

  /// Null: no device sends unasked.
  Device* device() const { return device_; }
  /// What `device` sends unasked. Null: there is no such device.
  const protocols::Standing* standing() const;
  /// Its messages count.
  bool in_use() const { return device_ != nullptr && device_->in_use; }

  struct Said {
    Outcome outcome = Outcome::ok;
    std::string reason;
    std::string remedy;
    Now received{};  ///< its last byte
    std::vector<Sample> samples;
    std::optional<ReportedEvents> events;  ///< to be kept
    std::size_t lost = 0;                  ///< events that are not
    std::string warning;                   ///< of the first of these; else empty
  };
  /// Only in use.
  Said OnMessage(const UnaskedMessage& message, Now now);
  /// The time between the last two messages.
  Duration rest() const { return rest_; }
  /// When OnTimer may have something even without a message.
  std::optional<Instant> DueAt() const;
  /// Returns what follows when time passes without a message. Its outcome is not counted.
  std::optional<Said> OnTimer(Now now);

  /// A batch of its events is on the disk.
  void OnKept() { backlog_.OnKept(); }
  /// All that it was heard to send is saved. It sends at once, so no event is left in it.
  bool drained() const { return device_ != nullptr && backlog_.waiting() == 0; }

 private:
  Said Take(protocols::Answer answer, Now received);
  void Keep(protocols::EventBatch batch, Said& said);

  Device* const device_;
  Instant last_{};             // its last message
  Duration rest_ = kLongIdle;  // before that one
  EventBacklog backlog_;
  bool told_lost_ = false;  // the user knows that events are lost
};

// What a device says unasked, on its way from the line: what it means (Speaker), how it is counted,
// and where its readings go (Intake).
class UnaskedSide {
 public:
  /// All outlive it.
  UnaskedSide(const Roster& roster, LineObserver& observer, Accounts& accounts,
              DeviceTracker& tracker, Intake& intake)
      : speaker_(roster),
        observer_(observer),
        is_network_(roster.is_network()),
        accounts_(accounts),
        tracker_(tracker),
        intake_(intake) {
    if (const Device* const device = speaker_.device()) accounts_.devices.OnSpeaks(*device);
  }

  /// See Speaker.
  const protocols::Standing* standing() const { return speaker_.standing(); }
  std::optional<Instant> Deadline() const { return speaker_.DueAt(); }
  /// Its messages count.
  bool listens() const { return speaker_.in_use(); }

  void OnOpened();
  /// Bytes of the line.
  void Overhear(View bytes, Instant now);
  /// Takes what the line has made of these bytes: a message, or the damage in them.
  void OnInput(const UnaskedInput& heard, Now now);
  void OnTimer(Now now);
  /// A batch of events of the device is on the disk.
  void OnKept(const Device& device);
  /// An input was handled.
  void OnSettled(Instant now);

 private:
  void Take(Speaker::Said said, Instant now);

  Speaker speaker_;
  LineObserver& observer_;
  const bool is_network_;
  bool first_ = true;  // nothing has come since the port was opened
  Accounts& accounts_;
  DeviceTracker& tracker_;
  Intake& intake_;
};

}  // namespace baudgate::bus
