// A Modbus TCP line with several lanes under virtual time: driver, pollers, and a server that does
// as the test likes. What the devices measure is known: a value of another device is seen at once.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "gateway/daemon/line_driver.h"
#include "protocols/modbus/protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate {

/// How the server takes several requests at a time.
struct ServerManner {
  enum class Kind : std::uint8_t {
    together,    ///< each is answered after `think`
    shuffled,    ///< after up to `think`, in any order
    one_by_one,  ///< each takes `think`, and waits for those before it
    first_only,  ///< what comes while another is under way is lost
    refuses,     ///< what comes while another is under way is answered "busy"
    closes,      ///< it closes the connection when a second one comes
    swaps,       ///< the numbers of two replies are mixed up
    repeats,     ///< every reply has the number of the one before
  } kind = Kind::together;
  Duration think = 20ms;
};

class LanesRig : public PortRetries {
 public:
  static constexpr int kPoints = 3;
  static constexpr std::uint8_t kFirstUnit = 10;

  LanesRig(int devices, int pipeline, const std::function<void(config::Line&)>& change = {});
  ~LanesRig() override;

  void Start();
  void RunFor(Duration time);
  bool RunUntil(const std::function<bool()>& done, Duration limit);
  /// The connection ends; it is opened again after a second, while the server is there.
  void CloseByServer();

  bool AllGood();
  bool Good(std::uint32_t device);
  double Truth(std::uint32_t device, std::uint32_t point) const {
    return 1000.0 * (device + 1) + point;
  }
  void Write(std::uint32_t device, double value, Duration within = 10s);
  LineStatus status() const { return store_->ReadLine(0); }
  DeviceStatus StatusOf(std::uint32_t device) const;
  LineDriver& driver() { return *driver_; }
  Now now() const { return now_; }
  /// Most requests under way at a time, at any time so far.
  std::size_t most_under_way() const { return most_under_way_; }

  ServerManner manner;
  bool there = true;                  ///< the server
  std::set<std::uint32_t> dead;       ///< devices behind it
  std::vector<WriteEnd> ends;         ///< of Write
  std::map<std::uint32_t, int> wire;  ///< writes that reached the devices
  std::size_t opens = 0;
  std::size_t asked = 0;  ///< requests that reached the server
  std::size_t wrong = 0;  ///< values that are another device's

 private:
  class Port;
  struct Coming {
    Bytes reply;  ///< empty: the request is lost
    std::uint64_t connection = 0;
  };

  void OnOpened() override {}
  void OnWorked() override {}
  bool OnDown(const std::string& reason) override;
  void Stop() override { reopen_.reset(); }

  void Take(const Bytes& request);
  Bytes AnswerOf(const Bytes& request);
  bool Step(Instant until);
  void GoTo(Instant instant);
  void Check();

  config::Config config_;
  std::unique_ptr<PointStore> store_;
  std::unique_ptr<Port> port_;
  std::vector<std::unique_ptr<FixedValues>> values_;
  std::vector<std::unique_ptr<Twin>> twins_;
  std::unique_ptr<LineDriver> driver_;
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
  std::multimap<Instant, Coming> coming_;
  std::optional<Instant> reopen_;
  std::optional<Instant> opening_;
  std::uint64_t connection_ = 0;
  Instant busy_until_{};
  std::size_t most_under_way_ = 0;
  Bytes last_number_;
  std::mt19937 random_{7};
  std::vector<Bytes> to_server_;
};

}  // namespace baudgate
