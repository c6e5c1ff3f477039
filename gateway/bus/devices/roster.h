// The members of a line: the devices of the configuration, and slaves that only transparent routes
// reach. Roster makes the devices from the configuration, and a slave when it is first asked. The
// parts of the poller keep what they know of a member by its place here. ByMember is a container
// with a place for each member.
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
  Device* device = nullptr;  // itself; null: a slave that only routes reach
  std::size_t place = 0;     // in the roster; of a device also its number in the schedule
  std::uint32_t index = 0;   // see gateway/bus/exchange/line.h
  std::uint8_t slave = 0;    // its Modbus address, where routes may reach it; 0: they do not
  bool in_use = true;
  int max_retries = 0;
  const protocols::Protocol* protocol = nullptr;
  protocols::ParsedOptions options;  ///< of a device; a slave that only routes reach has the line's
  config::SerialSettings serial;
  config::Timing timing;  ///< of a device: its times, and where each comes from
  LineTimes times;
  DeviceHealth health;
  /// The address in its replies; empty: they carry none, or it is not known yet.
  Bytes sender;

  /// Their replies cannot be told apart: two entries of one address.
  bool IsSame(const Member& other) const {
    return this == &other ||
           (!sender.empty() && sender == other.sender && protocol == other.protocol);
  }
  /// Of a device in the configuration; else "slave 7".
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
  std::string memory;                             // of the conversation, as it was reported last
  config::Timing configured;                      // `timing`, if it needs no longer times
  std::vector<protocols::Query> planned_queries;  // of the conversation, as the line knows them

  /// Takes over what the conversation has learned of its times. True: they have changed.
  bool LearnTimes();
};

/// Has no configuration, no conversation, and no place in store and schedule.
struct Slave : Member {};

class Roster {
 public:
  using FindProtocol = std::function<const protocols::Protocol&(const std::string& name)>;

  /// `line` outlives the roster. `first_device`: the index of line.devices[0] in the store.
  Roster(const config::Line& line, std::uint32_t first_device, const FindProtocol& find);

  const std::vector<std::unique_ptr<Device>>& devices() const { return devices_; }
  /// Devices, then slaves, in the order of their places.
  const std::vector<Member*>& everyone() const { return everyone_; }
  Device& device(std::size_t place) const { return *devices_[place]; }
  /// The first device that sends unasked: a line has at most one. Null: there is none.
  Device* Speaker() const;
  /// `index`: in the point store.
  Device& DeviceAt(std::uint32_t index) const { return *devices_[index - devices_.front()->index]; }

  /// How messages of other protocols are known on this line.
  void SetForeign(std::vector<protocols::ForeignRule> foreign) { foreign_ = std::move(foreign); }
  const std::vector<protocols::ForeignRule>& foreign() const { return foreign_; }

  /// The line is behind a serial server.
  bool is_network() const { return line_.is_network(); }
  /// The line's protocol, when it carries Modbus; null: no routes lead here.
  const protocols::Protocol* carrier() const { return carrier_; }
  /// A device of this Modbus address, or a slave that has been asked before; null: neither.
  Member* FindSlave(std::uint8_t slave) const;
  /// Adds it if no member has its address yet.
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

// What a part of the poller keeps for each member of the roster. An entry is made when it is first
// used, and never moves.
template <typename Entry>
class ByMember {
 public:
  Entry& operator[](const Member& member) { return At(member.place); }
  const Entry& operator[](const Member& member) const { return At(member.place); }
  /// By place.
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

  mutable std::deque<Entry> entries_;  // by place
};

}  // namespace baudgate::bus
