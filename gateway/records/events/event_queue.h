// The way in for all events, and the view of those that are not in the file yet. Any thread may
// call it. No call waits for the disk, except End. gateway/records/events/event_rounds.h is the way
// out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "gateway/records/events/event_source.h"
#include "gateway/records/events/pending_events.h"

namespace baudgate::events {

class EventQueue {
 public:
  /// `options` and `pending` outlive it.
  EventQueue(const LogOptions& options, PendingEvents& pending)
      : options_(options), pending_(pending) {}

  /// A batch of a device, with its names.
  void Add(Batch batch);
  /// An event of the gateway itself. It is left out if there are too many of its kind; see Shares.
  void Tell(EventRecord record);
  /// The values of a record are written in one commit. A record that is already in the file is not
  /// written again.
  void Keep(KeptRecord record);
  /// The gateway has started. This event comes before all others, and says how the previous run
  /// ended. Without a start, the run has no event for its end.
  void Started(const std::string& version);
  /// Adds the event for the end of this run; a second call adds none.
  void TellEnd();
  /// As TellEnd, for outputs that are to see this event: returns when it is on the disk, when the
  /// disk is in trouble, or after `most`.
  void End(Duration most);
  /// See EventSource.
  std::size_t Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done);
  /// Calls `opened` once when the file is open: at once, or on the writing thread.
  void WhenOpened(std::function<void()> opened);
  bool opened() const;
  /// A reload: gives all sources their new numbers. What is known of a source, also by a commit
  /// that is under way, stays with its names. Alarms that `watches` does not know end.
  void Renumber(SourceNames sources, Watched watches);

  /// The text (see EventBatch) of the source's last batch in the file. Valid once the file is open.
  std::string said(Source source) const;
  EventsState state() const;
  /// See PendingEvents.
  std::vector<Alarm> Alarms() const;

 private:
  const LogOptions& options_;
  PendingEvents& pending_;
};

}  // namespace baudgate::events
