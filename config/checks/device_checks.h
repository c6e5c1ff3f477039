// Whether a device fits its protocol, its times each other, and its address those of the others on
// its line. Devices come from the readers or from commands; what is wrong goes to Problems.
// CheckPaces finds times that do not count.
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

// Times, periods and retries that somebody wrote and that do not count, because something else
// overrules them. Paces come from config/devices; warnings go to Problems.

/// The paces of one device: its own, its profile's and its line's (before the gateway). `mark`: of
/// the device.
struct Paces {
  const Pace& device;
  const Pace& profile;
  const Pace& line;
};
void CheckPaces(const Paces& paces, const std::string& device, const Mark& mark,
                Problems& problems);

/// The name of a device that stands for all devices of a profile.
inline constexpr std::string_view kOfThisType = "of this type";

/// The addresses of one line's devices.
class LineAddresses {
 public:
  /// An error when the protocol does not take the device's address; a warning when an earlier
  /// device of this protocol has the same one, however each writes it. `mark`: of the address.
  void Add(const Device& device, const protocols::Protocol& protocol, const Mark& mark,
           Problems& problems);

 private:
  struct Owner {
    std::string name;
    std::string spelling;
  };
  std::map<std::pair<const protocols::Protocol*, std::string>, Owner> owners_;
};

/// A device whose points, options and times are complete. `keys`: of the device, for the places of
/// problems. Without a protocol what only it can judge is left out.
void CheckDevice(const Device& device, const protocols::Protocol* protocol, const Keys& keys,
                 Problems& problems);

/// Reports the errors that the protocol finds in single points of the device.
void CheckFaults(const Device& device, const protocols::Protocol& protocol, Problems& problems);

}  // namespace baudgate::config
