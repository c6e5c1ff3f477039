// `SpaTwin` simulates a relay on the SPA Bus from its profile.
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

/// SpaTwin is silent to requests for other slaves, broadcasts and frames without a slave number.
/// NACK 0 answers a wrong checksum, 3 a request whose reply would be too long, 5 wrong syntax, 6
/// items that the profile lacks, and 7 items that cannot be read or written now. NACK 8 answers a
/// value that the item does not accept, for example with too many decimals.
///
/// Its register holds 65 events, like that of an SPCJ 4D28; each L takes five events out, and B
/// repeats them. If a write has several values, those before the first refused value are stored.
class SpaTwin final : public Twin {
 public:
  SpaTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override;
  /// Stores the event with the seconds of `now`. Returns false if the register is full; its last
  /// entry then is E51 (overflow).
  bool Raise(const DeviceEvent& event, Now now) override;

 private:
  std::string TakeEvents();
  Bytes Read(const Command& command, Instant now);
  Bytes Write(const Command& command);
  /// Writes an item. Returns the code of the NACK, or nothing if the item was written.
  std::optional<int> WriteItem(const Address& item, const std::string& data);
  Bytes WritePassword(std::uint32_t item, const std::string& data);
  Bytes Nack(int code) const;
  Result<std::string> Text(const Address& item, Instant now) const;

  const config::Device& device_;
  TwinPoints<Address> points_;
  unsigned slave_;
  unsigned reply_as_;
  int reading_ = 0;  ///< the checksum variant of the simulated device, one of kCovers…
  std::size_t write_items_ = 1;
  std::int64_t password_ = 0;
  bool open_ = false;
  std::deque<std::string> events_;
  std::string last_events_;  ///< the events in the reply to the latest L, which B repeats
  int status_ = 0;           ///< bits of the status, item C
};

}  // namespace baudgate::protocols::spabus
