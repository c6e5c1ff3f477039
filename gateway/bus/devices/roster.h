// `Roster` contains the members of a line. A member is a device of the configuration, or a slave
// without configuration that only transparent routes reach. The roster makes the devices from the
// configuration, and a slave when a client first sends a request to it. Parts of the poller store
// their data about a member in a `ByMember`, which has one entry for each index of the roster.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/base/bytes.h"
#include "gateway/bus/devices/device_health.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/readings.h"
#include "protocols/protocol.h"

namespace baudgate::bus {

struct Device;

struct Member {
  Device* device =
      nullptr;  // this member as a device; null: the member is a slave that only routes reach
  std::size_t place = 0;    // index in the roster; for a device also its number in the schedule
  std::uint32_t index = 0;  // number for stores and taps: see Tap in gateway/bus/exchange/line.h
  // Modbus address at which routes reach the member; 0: routes cannot reach it.
  std::uint8_t slave = 0;
  bool in_use = true;
  int max_retries = 0;
  const protocols::Protocol* protocol = nullptr;
  /// The options of the device; for a slave that only routes reach, the options of the line.
  protocols::ParsedOptions options;
  config::SerialSettings serial;
  /// The times as the status shows them, each with its source; unused for a slave that only routes
  /// reach.
  config::Timing timing;
  LineTimes times;
  DeviceHealth health;
  /// The address in the replies of the member. Empty: its replies contain no address, or the
  /// address is not known yet.
  Bytes sender;

  /// True if the replies of the two members cannot be told apart, because both have one address.
  bool IsSame(const Member& other) const {
    return this == &other ||
           (!sender.empty() && sender == other.sender && protocol == other.protocol);
  }
  /// Returns the configured name of a device, or "slave 7".
  std::string Name() const;
};

struct Device : Member {
  explicit Device(const config::Device& its) : config(&its), jumps(its.points) { device = this; }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const config::Device* config = nullptr;
  std::unique_ptr<protocols::Conversation> conversation;
  JumpCheck jumps;
  HeardPoints heard;
  std::string memory;         // Conversation::Memory() as reported last
  config::Timing configured;  // `timing` before LearnTimes made it longer
  // Queries of the conversation that the schedule contains.
  std::vector<protocols::Query> planned_queries;

  /// Sets the times to those that the conversation has learned. Returns true if they have changed.
  bool LearnTimes();
};

/// A member that only routes reach. It has no configuration and no conversation, and is neither in
/// the point store nor in the schedule.
struct Slave : Member {};

class Roster {
 public:
  using FindProtocol = std::function<const protocols::Protocol&(const std::string& name)>;

  /// `line` must stay valid for the lifetime of the roster. `first_device`: the index of the line's
  /// first device in the point store.
  Roster(const config::Line& line, std::uint32_t first_device, const FindProtocol& find);

  const std::vector<std::unique_ptr<Device>>& devices() const { return devices_; }
  /// Returns all devices, then all slaves. The index is the `place` of the member.
  const std::vector<Member*>& everyone() const { return everyone_; }
  Device& device(std::size_t place) const { return *devices_[place]; }
  /// Returns the device that sends messages unasked, or null. A line has at most one such device.
  Device* Speaker() const;
  /// `index`: number of the device in the point store.
  Device& DeviceAt(std::uint32_t index) const { return *devices_[index - devices_.front()->index]; }

  void SetForeign(std::vector<protocols::ForeignRule> foreign) { foreign_ = std::move(foreign); }
  const std::vector<protocols::ForeignRule>& foreign() const { return foreign_; }

  /// True if the serial line is behind a serial server in the network.
  bool is_network() const { return line_.is_network(); }
  /// Returns the protocol of the line if it can carry Modbus requests of routes, else null.
  const protocols::Protocol* carrier() const { return carrier_; }
  /// Returns the device with this Modbus address, or the slave that SlaveAt has added; else null.
  Member* FindSlave(std::uint8_t slave) const;
  /// Returns the member with this Modbus address. Adds a slave if there is no member.
  Member& SlaveAt(std::uint8_t slave);

 private:
  void AddDevice(const config::Device& config, const protocols::Protocol& protocol,
                 protocols::Bus* bus);

  const config::Line& line_;
  const std::uint32_t first_device_;
  const protocols::Protocol* carrier_ = nullptr;
  std::vector<protocols::ForeignRule> foreign_;
  std::vector<std::unique_ptr<protocols::Bus>> buses_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<std::unique_ptr<Slave>> slaves_;
  std::vector<Member*> everyone_;
  std::map<std::uint8_t, Member*> by_slave_;
};

// `ByMember` contains one entry for each member of the roster. An entry is created at its first
// use; its address in memory never changes.
template <typename Entry>
class ByMember {
 public:
  Entry& operator[](const Member& member) { return At(member.place); }
  const Entry& operator[](const Member& member) const { return At(member.place); }
  Entry& At(std::size_t place) {
    Reach(place);
    return entries_[place];
  }
  const Entry& At(std::size_t place) const {
    Reach(place);
    return entries_[place];
  }

  auto begin() { return entries_.begin(); }
  auto end() { return entries_.end(); }
  auto begin() const { return entries_.cbegin(); }
  auto end() const { return entries_.cend(); }

 private:
  void Reach(std::size_t place) const {
    if (entries_.size() <= place) entries_.resize(place + 1);
  }

  mutable std::deque<Entry> entries_;
};

}  // namespace baudgate::bus
