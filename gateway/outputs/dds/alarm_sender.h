// Which alarm is published next: each one that has changed, as it is now; all of them to a new
// reader. Pure; gateway/outputs/dds/notice_sender.h sends.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/outputs/dds/event_supply.h"

namespace baudgate::dds {

class AlarmSender {
 public:
  /// Null: there are none. It outlives this.
  explicit AlarmSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// The one to be sent; null: none now. The same until OnSent.
  const AlarmSample* Next();
  void OnSent();

 private:
  EventSupply* const supply_;
  std::uint64_t version_ = 0;  ///< of the last that was sent
  std::vector<EventSupply::Alarm> batch_;
  std::size_t next_ = 0;  ///< of batch_
};

}  // namespace baudgate::dds
