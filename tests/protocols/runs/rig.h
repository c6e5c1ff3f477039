// A line of real devices in a test: shipped profile, real plugin, its twins, virtual time, and an
// oracle that knows what the twins measure. Profiles come from config/profiles.
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
  std::string name;  ///< letters and digits only
  const Protocol* protocol = nullptr;
  /// Whether the check value in a frame is right, worked out by the test and not by the plugin.
  bool (*good_checksum)(View frame) = nullptr;
  std::string profile;
  config::SerialSettings serial;
  std::vector<std::string> addresses;  ///< one device each
  std::vector<std::pair<std::string, config::OptionValue>> options;
};

inline void PrintTo(const Setup& setup, std::ostream* out) { *out << setup.name; }
inline std::string SetupName(const ::testing::TestParamInfo<Setup>& info) {
  return info.param.name;
}

/// The lines that are tested: each protocol at the bit rate and in the character format that its
/// reference gives, with two devices of one kind.
const std::vector<Setup>& RealLines();
const Setup& RealLine(const std::string& name);
/// A connection: nothing of it is damaged, as TCP sees to that.
const Setup& TcpLine();

/// What the reply rule makes of `bytes` that come after `request`, and silence behind them.
struct HeardReply {
  std::optional<Bytes> frame;  ///< the first whole one
  Outcome blame = Outcome::none;
};
HeardReply Hear(const Protocol& protocol, const config::Options& options, View request, View bytes);

/// An echo in front of `reply` hides it: bytes of the request are taken for the reply's.
bool EchoHides(const Protocol& protocol, const config::Options& options, View request, View reply);

/// The devices of `setup`, every point of the profile in them.
config::Line LineOf(const Setup& setup);

class Rig {
 public:
  /// `change` may alter the line before it is built.
  explicit Rig(const Setup& setup, const std::function<void(config::Line&)>& change = {});

  /// Opens the line and runs it until every point of every device is Good. What the store shows
  /// then is what the oracle holds for true; it is compared with the twins' values first.
  void LearnTruth();

  /// From now on every value that is stored as anything but bad has to be the truth. `excuse` is
  /// asked about each that is not, with the device that it came from; without one it is a failure.
  void Watch(std::function<bool(std::uint32_t device)> excuse = {});

  VirtualLine& line() { return *line_; }
  VirtualLine* operator->() { return line_.get(); }
  const Setup& setup() const { return setup_; }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(setup_.addresses.size()); }
  const config::Device& device(std::uint32_t index) { return *line_->store().device(index); }

  bool AllGood(std::uint32_t device);
  bool AllGood();
  /// Fast points alone: those that are asked again and again.
  bool FastGood(std::uint32_t device);
  /// None of them is bad, though some may be uncertain by their age.
  bool FastUsable(std::uint32_t device);
  /// Any point that is Good or uncertain.
  bool AnyUsable(std::uint32_t device);

  std::size_t wrong() const { return wrong_; }

 private:
  using Pick = std::function<bool(config::Group group)>;
  using Demand = std::function<bool(Quality quality)>;

  /// Whether all points of the groups that are picked have a quality that is demanded.
  bool All(std::uint32_t device, const Pick& pick, const Demand& demand);
  void SetValues(std::uint32_t device);
  void CompareWithTwin(std::uint32_t device);
  void Check();
  static bool IsRight(const config::Point& point, const bus::PointRecord& shown,
                      const Value& truth);

  Setup setup_;
  std::unique_ptr<VirtualLine> line_;
  std::vector<std::vector<Value>> truth_;
  std::vector<std::vector<std::uint64_t>> seen_;  // seq of each point at the last check
  std::vector<std::uint32_t> exchanges_;          // of each device at the last check
  std::function<bool(std::uint32_t)> excuse_;
  std::size_t wrong_ = 0;
};

}  // namespace baudgate::protocols
