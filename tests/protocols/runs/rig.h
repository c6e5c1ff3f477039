// Rig is a line of real devices for tests: shipped profile (from config/profiles), real plugin,
// twins, virtual time, and an oracle that compares the store with the twins.
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
  /// True if the check value of a frame is valid, as computed by the test and not by the plugin.
  bool (*good_checksum)(View frame) = nullptr;
  std::string profile;
  config::SerialSettings serial;
  std::vector<std::string> addresses;  ///< one device for each
  std::vector<std::pair<std::string, config::OptionValue>> options;
};

inline void PrintTo(const Setup& setup, std::ostream* out) { *out << setup.name; }
inline std::string SetupName(const ::testing::TestParamInfo<Setup>& info) {
  return info.param.name;
}

/// Each protocol with the bit rate and character format of its reference, and two equal devices.
const std::vector<Setup>& RealLines();
const Setup& RealLine(const std::string& name);
/// A connection: its bytes are never damaged, because TCP protects them.
const Setup& TcpLine();

/// The result of the reply rule for `bytes` that come after `request` and are followed by silence.
struct HeardReply {
  std::optional<Bytes> frame;  ///< the first whole frame
  Outcome blame = Outcome::none;
};
HeardReply Hear(const Protocol& protocol, const config::Options& options, View request, View bytes);

/// True if an echo before `reply` hides it, because bytes of the request are taken for the reply.
bool EchoHides(const Protocol& protocol, const config::Options& options, View request, View reply);

config::Line LineOf(const Setup& setup);

class Rig {
 public:
  /// `change` may modify the line before it is built.
  explicit Rig(const Setup& setup, const std::function<void(config::Line&)>& change = {});

  /// Opens the line and runs it until every point is good. The values of the store are compared
  /// with those of the twins and become the truth for the oracle.
  void LearnTruth();

  /// From now on every stored value that is not bad must be the truth. `excuse` is called for each
  /// wrong value with its device; without an excuse a wrong value is a failure.
  void Watch(std::function<bool(std::uint32_t device)> excuse = {});

  VirtualLine& line() { return *line_; }
  VirtualLine* operator->() { return line_.get(); }
  const Setup& setup() const { return setup_; }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(setup_.addresses.size()); }
  const config::Device& device(std::uint32_t index) { return *line_->store().device(index); }

  bool AllGood(std::uint32_t device);
  bool AllGood();
  /// Fast points only.
  bool FastGood(std::uint32_t device);
  /// True if no fast point is bad; some may be uncertain.
  bool FastUsable(std::uint32_t device);
  /// True if any point is good or uncertain.
  bool AnyUsable(std::uint32_t device);

  std::size_t wrong() const { return wrong_; }

 private:
  using Pick = std::function<bool(config::Group group)>;
  using Demand = std::function<bool(Quality quality)>;

  /// True if all points of the picked groups have a demanded quality.
  bool All(std::uint32_t device, const Pick& pick, const Demand& demand);
  void SetValues(std::uint32_t device);
  void CompareWithTwin(std::uint32_t device);
  void Check();
  static bool IsRight(const config::Point& point, const bus::PointRecord& shown,
                      const Value& truth);

  Setup setup_;
  std::unique_ptr<VirtualLine> line_;
  std::vector<std::vector<Value>> truth_;
  std::vector<std::vector<std::uint64_t>> seen_;  // sequence number of each point at the last check
  std::vector<std::uint32_t> exchanges_;          // exchanges of each device at the last check
  std::function<bool(std::uint32_t)> excuse_;
  std::size_t wrong_ = 0;
};

}  // namespace baudgate::protocols
