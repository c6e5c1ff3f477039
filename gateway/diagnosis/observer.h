// Watches a line for the status: what its exchanges look like (Examiner), and what the device that
// sends unasked looks like (Overheard), both in gateway/diagnosis/damage/examiner.h. Start here to
// read the diagnosis: findings are counted in gateway/bus/points/findings.h, and
// gateway/diagnosis/causes/diagnose.h makes sentences of them. Decides nothing on the bus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "gateway/bus/devices/poller_listener.h"
#include "gateway/diagnosis/damage/examiner.h"

namespace baudgate {

class Observer : public LineObserver {
 public:
  /// `roster` outlives it.
  explicit Observer(const Roster& roster);

  void OnOpened() override { examiner_.OnOpened(); }
  void OnRequest(const Member& member, const Request& request, Instant now) override;
  void Hear(View bytes, Instant now) override { examiner_.Hear(bytes, now); }
  void OnReply(View frame) override { examiner_.Take(frame); }
  Finding TakeFinding(Outcome outcome) override { return examiner_.End(outcome); }
  bool TakeNegotiation() override { return examiner_.TakeNegotiation(); }
  std::vector<EarlierFinding> TakeChanged() override;

  std::optional<Finding> OnUnaskedBytes(View bytes, Instant now) override;
  bool IsNegotiation(View bytes) const override;
  Finding OnUnaskedDamage() override;
  void OnUnaskedRead() override;

 private:
  Examiner examiner_;
  std::optional<Overheard> overheard_;  // of the first device that sends unasked
};

/// For Poller.
std::unique_ptr<LineObserver> Observe(const Roster& roster);

}  // namespace baudgate
