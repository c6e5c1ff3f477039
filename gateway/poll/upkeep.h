// What every exchange means for its device, and what follows when a device comes, goes, or may be
// another one: its plan, its schedule, its state, and the doubt of what it has said. Told by
// gateway/poll/poller.cpp and job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/poll/chooser.h"
#include "gateway/poll/ledger.h"
#include "gateway/poll/owed_replies.h"
#include "gateway/poll/roster.h"
#include "gateway/store/point_store.h"

namespace baudgate {

class Upkeep {
 public:
  /// All references outlive it.
  Upkeep(Roster& roster, PointStore& store, OwedReplies& owed, Chooser& chooser, Ledger& ledger);

  /// The port has opened.
  void OnOpened(Instant now);
  /// An exchange has ended, whatever it was for.
  void OnExchange(const Job& job, const ExchangeEnd& end, const Finding& finding, Instant now);
  /// A task has ended: a device may be offline now, or back.
  void OnTask(Member& member, Outcome outcome, const std::string& reason, Instant now);
  /// It has said something unasked, and this is what became of it.
  void OnUnasked(Device& device, Outcome outcome, const std::string& reason, const Finding& finding,
                 Instant now);
  /// Another device answers in its place: nothing that the old one has said holds.
  void OnReplaced(Device& device, Now now);
  /// What its conversation wants to do in the background may be due at another time now.
  void PlanBackground(const Device& device);
  /// It has said something: it may be what it should be, or not any more.
  void OnHeard(Device& device, Instant now);
  /// Its conversation knows what it was told before a restart.
  void OnRecalled(Device& device);
  /// One of the latest replies belonged to another request, nobody knows which.
  void DoubtLatest(Instant now);
  /// What this query reads is uncertain until it is read again. False: there is no such query now.
  bool Doubt(const QueryRef& read, Instant now);
  /// These points are uncertain until they are read again.
  void Doubt(const Device& device, const std::vector<std::size_t>& points, Instant now);
  void SetInUse(Device& device, bool in_use, bool open, Instant now);
  /// A person wants it asked now, whether it was in use or not.
  void OnEnabled(Device& device, bool open, Instant now);
  /// Its conversation has other queries now.
  void Plan(Device& device);
  /// No request of the member, or of one that is the same on the wire, may be met by what is still
  /// under way: their polls wait.
  void HoldBack(const Member& member);
  void ShowLine(Instant now) { ledger_.line.Show(chooser_.probes().NoticeBound(now)); }

  /// What could not be read once is tried again after the slow period, at least every hour; of the
  /// daily group the whole round, at most every 5 min.
  void Repeat(const Device& device, config::Group group, Instant now);

 private:
  void Charge(const Job& job, bool answered, Instant now);
  void Reconnect(Device& device, Instant now);
  void DoubtAll(const Device& device, Instant now);
  void DoubtSeldom(Device& device, Instant now);

  Roster& roster_;
  PointStore& store_;
  OwedReplies& owed_;
  Chooser& chooser_;
  Schedule& schedule_;  // of the chooser's agenda
  Ledger& ledger_;
};

}  // namespace baudgate
