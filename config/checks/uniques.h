// What may stand only once in the whole configuration: names, unit ids, ports. Told by the readers
// as they go; who comes second is a problem that names the first. CheckName says what a name may
// be.
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

// Names that gateways, lines, devices and points may have.

/// Letters, digits and single '_' or '-' between them, at most 64 (the key length of the DDS
/// topics).
Status CheckName(std::string_view name);
/// Letters, digits and single '_' before or between them, no digit first: an identifier of IEC
/// 61131-3, and usable as one everywhere.
Status CheckPointName(std::string_view name);

/// Names and numbers that must be unique in the gateway. A second use is an error that names the
/// first.
class Uniques {
 public:
  explicit Uniques(Problems& problems) : problems_(problems) {}

  void Line(const std::string& name, const Mark& mark);
  void Device(const std::string& name, const Mark& mark);
  void Unit(std::uint8_t unit, const std::string& device, const Mark& mark);
  /// Links such as /dev/serial/by-id/… count as what they lead to. `shared`: a server that takes
  /// several connections; other lines that say so may name it as well.
  void Port(const std::string& port, const std::string& line, bool shared, const Mark& mark);
  /// A serial port at which a master waits; in one table with the ports of lines.
  void ListenerPort(const std::string& path, const Mark& mark);
  /// No two at one port of one address; 0.0.0.0 and :: are all of them. `what`: its key.
  void Address(const std::string& what, const HostPort& at, const Mark& mark);

 private:
  struct Owner {
    std::string name;
    Mark mark;
    bool shared = false;
  };
  using Owners = std::map<std::string, Owner>;
  /// The first owner when there is one already.
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
