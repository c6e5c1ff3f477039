// The journals of a simulated meter: the last records of each, the newest at the last place.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>

#include "gateway/base/bytes.h"
#include "protocols/common/civil_zone.h"
#include "protocols/conversation.h"

namespace baudgate::protocols::set4tm {

class TwinJournals {
 public:
  TwinJournals(const CivilZone& zone, std::size_t records) : zone_(zone), most_(records) {}

  /// By the codes of journal.h. False: there is no such journal.
  bool Raise(const DeviceEvent& event, WallTime now);
  /// The record that `pdu` asks for, zeros where it holds none; empty: nothing of this journal
  /// has happened here, or it is none.
  std::optional<Bytes> Record(View pdu) const;
  /// The meter keeps such a record, if only an empty one.
  bool Has(View pdu) const;

 private:
  CivilZone zone_;
  std::size_t most_;
  std::map<std::uint8_t, std::deque<Bytes>> journals_;
};

}  // namespace baudgate::protocols::set4tm
