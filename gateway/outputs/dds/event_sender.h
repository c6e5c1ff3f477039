// Which event is published next: each once, in the order of the numbers; to a new reader the newest
// ones once more. After a restart it goes on where it was, if subscribers have confirmed that.
// Pure; gateway/outputs/dds/notice_sender.h sends.
//
//   there are 1 … 5000, and a reader comes    → 4001, 4002 … 5000
//   5001 happens                              → 5001
//   it leaves after 5001, another comes       → 4002 … 5001
//   5002 … 7500 happen before another comes   → 4002 … 7500: also those that no reader has had
//   an orderly end, a start, and 7501         → 7501
//   a kill and a start                        → 6502 … 7501: some may have been lost on their way
//
// What has left the supply before it was taken is skipped, and counted.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "gateway/outputs/dds/event_supply.h"

namespace baudgate::dds {

/// How many of the newest go to a new reader, and how many before the last that was sent.
inline constexpr std::uint64_t kEventImage = 1000;

class EventSender {
 public:
  /// Null: there are no events. It outlives this.
  explicit EventSender(EventSupply* supply) : supply_(supply) {}

  void StartAnew();
  /// The one to be sent; null: none now. The same until OnSent.
  const EventSample* Next();
  void OnSent();
  /// Subscribers have all that was sent.
  void Confirm();

  /// From any thread.
  std::uint64_t sent() const { return sent_; }
  std::uint64_t skipped() const { return skipped_; }

 private:
  bool FindPlace();
  void GoTo(std::uint64_t seq);
  bool Load();

  EventSupply* const supply_;
  bool placed_ = false;        ///< for whoever takes samples now
  bool ever_ = false;          ///< for anybody
  std::uint64_t place_ = 0;    ///< number of the last that was sent
  std::uint64_t reached_ = 0;  ///< the highest of these; what is sent before it comes once more
  std::vector<EventSample> batch_;
  std::size_t next_ = 0;  ///< of batch_
  std::atomic<std::uint64_t> sent_ = 0;
  std::atomic<std::uint64_t> skipped_ = 0;
};

}  // namespace baudgate::dds
