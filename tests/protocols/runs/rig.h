// Rig is a line of real devices for tests: shipped profile (from config/profiles), real protocol,
// simulated devices, virtual time, and an oracle that compares the store with the simulated
// devices.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "protocols/protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {

struct Setup {
  std::string name;
  const Protocol* protocol = nullptr;
  /// True if the check value of a frame is valid, as computed by the test and not by the protocol.
  bool (*good_checksum)(View frame) = nullptr;
  std::string profile;
  config::SerialSettings serial;
  std::vector<std::string> addresses;
  std::vector<std::pair<std::string, config::OptionValue>> options;
};

inline void PrintTo(const Setup& setup, std::ostream* out) { *out << setup.name; }
inline std::string SetupName(const ::testing::TestParamInfo<Setup>& info) {
  return info.param.name;
}

/// Returns a line for each protocol, with the serial settings of its reference and two devices of
/// one profile.
const std::vector<Setup>& RealLines();
const Setup& RealLine(const std::string& name);
/// Returns a Modbus TCP line. Its bytes are never damaged, because TCP protects them.
const Setup& TcpLine();

/// The result of the reply rule for `bytes` that follow `request` and are followed by silence.
struct HeardReply {
  std::optional<Bytes> frame;
  Outcome blame = Outcome::none;
};
HeardReply Hear(const Protocol& protocol, const config::Options& options, View request, View bytes);

/// True if an echo before `reply` hides it, because its bytes are mistaken for the reply.
bool EchoHides(const Protocol& protocol, const config::Options& options, View request, View reply);

config::Line LineOf(const Setup& setup);

class Rig {
 public:
  explicit Rig(const Setup& setup, const std::function<void(config::Line&)>& change = {});

  /// Opens the line, runs it until every point is good, and compares the store with the simulated
  /// devices. From then on, these values count as the truth.
  void LearnTruth();

  /// From now on, every value that is not bad must be the truth, unless `excuse` accepts the wrong
  /// value of the device.
  void Watch(std::function<bool(std::uint32_t device)> excuse = {});

  VirtualLine& line() { return *line_; }
  VirtualLine* operator->() { return line_.get(); }
  const Setup& setup() const { return setup_; }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(setup_.addresses.size()); }
  const config::Device& device(std::uint32_t index) { return *line_->store().device(index); }

  bool AllGood(std::uint32_t device);
  bool AllGood();
  bool FastGood(std::uint32_t device);
  bool FastUsable(std::uint32_t device);
  bool AnyUsable(std::uint32_t device);

  std::size_t wrong() const { return wrong_; }

 private:
  using Pick = std::function<bool(config::Group group)>;
  using Demand = std::function<bool(Quality quality)>;

  bool All(std::uint32_t device, const Pick& pick, const Demand& demand);
  void SetValues(std::uint32_t device);
  void CompareWithTwin(std::uint32_t device);
  void Check();
  static bool IsRight(const config::Point& point, const bus::PointRecord& shown,
                      const Value& truth);

  Setup setup_;
  std::unique_ptr<VirtualLine> line_;
  std::vector<std::vector<Value>> truth_;
  std::vector<std::vector<std::uint64_t>> seen_;
  std::vector<std::uint32_t> exchanges_;
  std::function<bool(std::uint32_t)> excuse_;
  std::size_t wrong_ = 0;
};

}  // namespace baudgate::protocols
