// A line can have one device that sends messages unasked. `Speaker` decodes its messages,
// `EventBacklog` counts its events that are not saved on disk yet, and `UnaskedSide` connects
// `Speaker` with the line.
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

// `EventBacklog` limits the event batches of a device that sends unasked and that are not saved on
// disk yet. The device cannot be told to wait, so events above the limit are lost, and counted.
// Example:
//
//   Take() 1000 times, OnKept() never    true
//   Take()                               false: one event is lost
//   OnKept(), Take()                     true; TakeLost() returns 1, reported with this batch
class EventBacklog {
 public:
  static constexpr std::size_t kMost = 1000;

  /// Call for a batch of `events` events. Returns false if the limit is reached: the events are
  /// lost.
  bool Take(std::size_t events) {
    if (waiting_ >= kMost) {
      lost_ += events;
      return false;
    }
    ++waiting_;
    return true;
  }
  void OnKept() {
    if (waiting_ > 0) --waiting_;
  }
  std::size_t TakeLost() { return std::exchange(lost_, 0); }
  std::size_t waiting() const { return waiting_; }

 private:
  std::size_t waiting_ = 0;  // number of batches
  std::size_t lost_ = 0;     // number of events
};

// `Speaker` decodes the messages of a device that sends unasked, and decides which of its events
// can wait for the disk (EventBacklog). Events above its limit are lost; the next event to be saved
// reports their number:
//
//   1000 messages, the disk fails    1000 batches to be saved
//   3 more, of an event each         no batch to be saved; 3 events lost, one warning
//   one is saved, then a message     to be saved: "lost before this event, because
//                                    the disk failed: 3 events"
class Speaker {
 public:
  explicit Speaker(const Roster& roster) : device_(roster.Speaker()) {}

  /// Null: no device of the line sends unasked.
  Device* device() const { return device_; }
  /// Returns how messages of the device are recognised. Null: no device of the line sends unasked.
  const protocols::Standing* standing() const;
  bool in_use() const { return device_ != nullptr && device_->in_use; }

  struct Said {
    Outcome outcome = Outcome::ok;
    std::string reason;
    std::string remedy;
    Now received{};  ///< when the last byte of the message came
    std::vector<Sample> samples;
    std::optional<ReportedEvents> events;
    std::size_t lost = 0;
    std::string warning;  ///< a warning for the user, at the first lost event; else empty
  };
  /// Returns the content of a message. Call only while in_use().
  Said OnMessage(const UnaskedMessage& message, Now now);
  Duration rest() const { return rest_; }
  /// Returns when OnTimer is to be called even if no message comes; empty: not before the next
  /// message.
  std::optional<Instant> DueAt() const;
  /// Returns readings or events that are due without a message; empty: there are none. Their
  /// outcome is not counted in the status.
  std::optional<Said> OnTimer(Now now);

  void OnKept() { backlog_.OnKept(); }
  /// True if all received events are saved on disk. The device sends events at once, so it contains
  /// no further events.
  bool drained() const { return device_ != nullptr && backlog_.waiting() == 0; }

 private:
  Said Take(protocols::Answer answer, Now received);
  void Keep(protocols::EventBatch batch, Said& said);

  Device* const device_;
  Instant last_{};
  Duration rest_ = kLongIdle;  // time between the last two messages
  EventBacklog backlog_;
  bool told_lost_ = false;  // the user was warned that events are lost
};

// `UnaskedSide` passes the messages of the device that sends unasked from the line to `Speaker`, to
// the counts of the status, and to `Intake`, which stores readings and events.
class UnaskedSide {
 public:
  /// All references must stay valid for the lifetime of this object.
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

  const protocols::Standing* standing() const { return speaker_.standing(); }
  std::optional<Instant> Deadline() const { return speaker_.DueAt(); }
  bool listens() const { return speaker_.in_use(); }

  void OnOpened();
  /// Call for all received bytes of the line, including those of replies.
  void Overhear(View bytes, Instant now);
  /// Takes messages that were found among the received bytes, and counts damaged messages.
  void OnInput(const UnaskedInput& heard, Now now);
  void OnTimer(Now now);
  void OnKept(const Device& device);
  /// Call after each input. Reports to Intake if all events of the device are saved on disk.
  void OnSettled(Instant now);

 private:
  void Take(Speaker::Said said, Instant now);

  Speaker speaker_;
  LineObserver& observer_;
  const bool is_network_;
  bool first_ = true;  // no bytes have come since the port was opened
  Accounts& accounts_;
  DeviceTracker& tracker_;
  Intake& intake_;
};

}  // namespace baudgate::bus
