// Events that a twin raises by itself, as the user writes them: "every:5s", "every:1s,count=3".
// They are those of its profile's table that go on and off, one after the other. Sans-I/O, as
// twin_faults.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "protocols/twin.h"

namespace baudgate {

struct EventSchedule {
  Duration every{};
  std::size_t count = 1;  ///< at a time
  /// Each says its number, from 1 on, so that a test can tell which are missing.
  bool numbered = false;
};

/// An error says what may stand there.
Result<EventSchedule> ParseEventSchedule(std::string_view text);

class TwinEvents {
 public:
  TwinEvents(const EventSchedule& schedule, Now start) : schedule_(schedule), start_(start) {}

  /// Raises what has become due: before each request that the twin answers. `device`: the twin's.
  void CatchUp(Twin& twin, const config::Device& device, Now now);

  std::uint64_t raised() const { return raised_; }
  std::uint64_t refused() const { return refused_; }  ///< there was no room in its register

 private:
  DeviceEvent Next(const config::Device& device) const;

  const EventSchedule schedule_;
  const Now start_;
  std::uint64_t rounds_ = 0;
  std::uint64_t raised_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace baudgate
