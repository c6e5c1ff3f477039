// `Uniques` finds names, unit ids and ports that occur twice in the configuration. The readers
// report each use while they read; the second use is an error that names the first. CheckName
// checks the form of a name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/network.h"
#include "config/model/problem.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// Accepts letters, digits and single '_' or '-' between them, at most 64 (the key length of the
/// DDS topics).
Status CheckName(std::string_view name);
/// Accepts letters, digits and single '_' before or between them, no digit first: an identifier of
/// IEC 61131-3, which nearly all programs accept.
Status CheckPointName(std::string_view name);

class Uniques {
 public:
  explicit Uniques(Problems& problems) : problems_(problems) {}

  void Line(const std::string& name, const Mark& mark);
  void Device(const std::string& name, const Mark& mark);
  void Unit(std::uint8_t unit, const std::string& device, const Mark& mark);
  /// Claims a port for a line. Links such as /dev/serial/by-id/… are the same port as their target.
  /// `shared`: the port is a TCP server that accepts several connections, so several lines are
  /// allowed to use it if each of them passes true.
  void Port(const std::string& port, const std::string& line, bool shared, const Mark& mark);
  /// Claims the serial port of a listener, which no other listener and no line can have.
  void ListenerPort(const std::string& path, const Mark& mark);
  /// Claims the address of a listener. 0.0.0.0 and :: collide with every address with the same
  /// port. `what` is the configuration key, for the message.
  void Address(const std::string& what, const HostPort& at, const Mark& mark);

 private:
  struct Owner {
    std::string name;
    Mark mark;
    bool shared = false;
  };
  using Owners = std::map<std::string, Owner>;
  /// Makes `name` the owner of `what` and returns null. If `what` has an owner already, returns
  /// this owner.
  static const Owner* Claim(Owners& owners, const std::string& what, const std::string& name,
                            const Mark& mark);

  Owners lines_, devices_, units_, ports_;
  struct Taken {
    HostPort at;
    Mark mark;
  };
  std::vector<Taken> addresses_;
  Problems& problems_;
};

}  // namespace baudgate::config
