// A relay on the SPA Bus, simulated from its profile: answers reads, writes and nonsense alike.
// Requests come from a pty or a test through rules.h, replies go back the same way.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "config/model/device.h"
#include "protocols/common/twin_points.h"
#include "protocols/spabus/codec.h"
#include "protocols/twin.h"

namespace baudgate::protocols::spabus {

/// Silent for other slaves, broadcasts and what has no slave number. NACK 0 for a wrong checksum,
/// 3 for what does not fit one reply, 5 for syntax, 6 for items that the profile lacks, 7 for items
/// that cannot be read or written now, 8 for a value that the item does not take: more decimals
/// than it has among them. Its register holds 65 events, as an SPCJ 4D28's does; five come with
/// each L, which takes them out, and once more with B. Of several values in one write those before
/// the first refused are taken.
class SpaTwin final : public Twin {
 public:
  SpaTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;
  /// Printed with the seconds of `now`. False as well where its register is full: then the last one
  /// is E51.
  bool Raise(const DeviceEvent& event, Now now) override;

 private:
  std::string TakeEvents();
  Bytes Read(const Command& command, Instant now);
  Bytes Write(const Command& command);
  /// The code of the NACK that the write of one item deserves; nothing when it is done.
  std::optional<int> WriteItem(const Address& item, const std::string& data);
  Bytes WritePassword(std::uint32_t item, const std::string& data);
  Bytes Nack(int code) const;
  /// The text of one item, or the code of the NACK that it deserves.
  Result<std::string> Text(const Address& item, Instant now) const;

  const config::Device& device_;
  TwinPoints<Address> points_;
  unsigned slave_;
  unsigned reply_as_;
  int reading_ = 0;  ///< how its checksums are computed (reply.h)
  std::size_t write_items_ = 1;
  std::int64_t password_ = 0;
  bool open_ = false;
  std::deque<std::string> events_;  ///< as printed
  std::string last_events_;         ///< that L has given
  int status_ = 0;                  ///< bits of the item C
};

}  // namespace baudgate::protocols::spabus
