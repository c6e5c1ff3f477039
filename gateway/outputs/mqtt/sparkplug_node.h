// `SparkplugNode` publishes the gateway as an edge node of Sparkplug B 3.0.0, and its devices as
// devices of the node. docs/mqtt.md lists the rules of the specification and their tests.
//
//   connect, will = NDEATH(bdSeq)      primary host: wait for STATE online
//   NBIRTH(bdSeq, seq 0), DBIRTH for each device that answers, then DDATA
//   device offline → DDEATH, answers again → DBIRTH; NCMD Rebirth → births again
//   stored values → DDATA with is_historical, then a message that the broker confirms
//
// Used on the thread of the session.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/mqtt/client.h"
#include "gateway/outputs/mqtt/live_points.h"
#include "gateway/outputs/mqtt/sparkplug.h"
#include "gateway/outputs/outlet/outlet.h"

namespace baudgate::mqtt {

class SparkplugNode {
 public:
  /// Passes the write request of a host on. `value`: as text.
  using Write = std::function<void(bus::PointRef at, const std::string& value, bool retained)>;

  /// The references must outlive this object. `gateway`: the name of the edge node. `barrier`: the
  /// topic of the message that the broker confirms after stored values.
  SparkplugNode(const config::Mqtt& settings, std::string gateway, std::string barrier,
                bus::PointStore& store, LivePoints& live, Client& client, Write write);

  /// Returns NDEATH with the number (bdSeq) of the next connection.
  Client::Will NextWill();
  void OnConnected();
  /// Takes NCMD, DCMD and STATE.
  void Take(const Message& message);
  /// Publishes births and changes.
  void Send(Now now);
  /// True if the births are published.
  bool born() const { return born_ && next_birth_ == live_.size(); }
  /// Makes all births due again, because the points have changed.
  void Rebirth();
  void SendStored(const outlet::Portion& portion, const std::function<void(outlet::Answer)>& done);
  /// The number of values that were published, without stored ones.
  std::uint64_t values() const { return values_; }

 private:
  enum class DeviceState : std::uint8_t { unborn, born, dead };

  std::string Topic(const char* type, const std::string& device = {}) const;
  void Publish(const std::string& topic, sparkplug::Payload payload);
  void BirthNode(Now now);
  /// Publishes DBIRTH if the device answers, or if `anyway` is set.
  void BirthDevice(std::uint32_t device, Now now, bool anyway = false);
  void KillDevice(std::uint32_t device);
  void Flush(std::uint32_t device, std::vector<sparkplug::Metric> metrics, Now now);
  bool IsOffline(std::uint32_t device) const;
  void TakeWrite(const Message& message, const sparkplug::Payload& payload,
                 const std::string& device);
  std::string Death() const;
  void TakeState(const Message& message);

  const config::Mqtt& settings_;
  const std::string gateway_;
  const std::string barrier_;
  bus::PointStore& store_;
  LivePoints& live_;
  Client& client_;
  const Write write_;
  std::uint8_t bd_seq_ = 255;  // the first connection has 0
  std::uint8_t seq_ = 0;
  std::uint64_t values_ = 0;
  bool born_ = false;
  std::uint32_t next_birth_ = 0;
  bool host_online_ = false;
  bool host_left_ = false;  ///< the primary host has gone offline, so the connection must end
  std::int64_t host_time_ = 0;
  std::vector<DeviceState> devices_;            // index: number in the store
  std::map<std::uint32_t, std::string> names_;  // names of devices that were born, for DDEATH
};

}  // namespace baudgate::mqtt
