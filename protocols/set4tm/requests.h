// What a SET-4TM meter is asked next: what a task needs first, and then the task's own request.
// What follows from the reply is in replies.h.
//
//   a poll of 08 1B 00 11     > 05 01 30 30 …    the channel is not open yet
//                             > 05 08 00         who is it?
//                             > 05 08 12         its type decides which floats there are
//                             > 05 08 1B 00 11
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/set4tm/meter_parts.h"

namespace baudgate::protocols::set4tm {

/// What a request is for.
enum class RequestKind : std::uint8_t {
  latch,       ///< the broadcast, which nobody answers
  link,        ///< link test
  other_mode,  ///< who is it, with the other checksum? The answer is for the status alone
  open,        ///< open the channel
  serial,      ///< who is it?
  question,    ///< type or ratios, before what they decide
  latch_time,  ///< has it heard the broadcast?
  record,      ///< of a journal
  background,  ///< of a load profile or a billing reading
  trial,       ///< a masked read, to learn whether the meter knows it
  read,        ///< a query of points
  write,       ///< a correction of the clock
};

class MeterRequests {
 public:
  /// `parts` outlive it.
  explicit MeterRequests(MeterParts& parts);

  /// The error: the task's value cannot be written.
  Result<Request> Next(const Task& task, Instant now);
  /// The kind of the latest request.
  RequestKind kind() const { return kind_; }

 private:
  /// From now on the latest request is of this kind.
  Request Make(RequestKind kind, View pdu);
  Result<Bytes> CorrectionOf(const Task& task, Instant now) const;
  /// What the session needs first; nothing: the task's own request may be sent.
  std::optional<Request> ForSession(const Task& task, Instant now);
  Request Own(const Task& task, Instant now);
  Request InOtherMode();
  Request Read(std::size_t query);
  bool AsksLatchTime(const Task& task, Instant now) const;

  MeterParts& parts_;
  const Bytes address_;
  RequestKind kind_ = RequestKind::open;
  unsigned probes_ = 0;  // of a meter that has never answered
};

}  // namespace baudgate::protocols::set4tm
