// Bytes of a device that sends unasked which its conversation could not read: what they looked like
// (gateway/diagnosis/damage/examine.h). Bounded memory.
//
//   Hear(bytes)    at any time; returns what the bytes before looked like, if these begin new ones
//   OnDamaged()    what they look like so far
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"

namespace baudgate {

class Overheard {
 public:
  /// Both outlive it.
  Overheard(const Device& device, const Roster& roster);

  /// Empty: what came before was read, or looks as reported already.
  std::optional<Finding> Hear(View bytes, Instant now);
  Finding OnDamaged();
  /// The next message could be read, so it is not the rest of the damaged one.
  void OnRead() { damaged_ = false; }

 private:
  Finding Look() const;
  bool IsRest() const;

  const Device& device_;
  const Roster& roster_;
  const Expectation expect_;
  Bytes heard_;  // since the last silence
  Bytes torn_;   // before the last silence, if they were damaged
  Instant last_{};
  Duration pause_{};   // between these two
  Duration before_{};  // the silence before both
  bool damaged_ = false;
};

}  // namespace baudgate
