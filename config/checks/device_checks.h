// Checks a device: against its protocol, its times against each other, and its address against
// other devices of its line. CheckPaces finds times, periods and retries that have no effect.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "config/model/device.h"
#include "config/model/problem.h"
#include "config/model/timing.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// The polling settings (Pace) that apply to one device. `line` contains those of the line, and
/// those of the gateway that the line does not set.
struct Paces {
  const Pace& device;
  const Pace& profile;
  const Pace& line;
};
/// Warns of configured times, periods and retries that have no effect, because a setting of higher
/// precedence overrides them. `mark` is the position of the device in the file.
void CheckPaces(const Paces& paces, const std::string& device, const Mark& mark,
                Problems& problems);

/// The name of a device that stands for all devices of a profile.
inline constexpr std::string_view kOfThisType = "of this type";

class LineAddresses {
 public:
  /// Reports an error if the protocol refuses the device's address, and a warning if an earlier
  /// device with this protocol has the same address, even in another spelling. `mark` is the
  /// position of the address in the file.
  void Add(const Device& device, const protocols::Protocol& protocol, const Mark& mark,
           Problems& problems);

 private:
  struct Owner {
    std::string name;
    std::string spelling;
  };
  std::map<std::pair<const protocols::Protocol*, std::string>, Owner> owners_;
};

/// Checks a device whose points, options and times are complete. `keys` has the positions of the
/// device's keys in the file, for messages. If `protocol` is null, the protocol's own checks are
/// left out.
void CheckDevice(const Device& device, const protocols::Protocol* protocol, const Keys& keys,
                 Problems& problems);

void CheckFaults(const Device& device, const protocols::Protocol& protocol, Problems& problems);

}  // namespace baudgate::config
