// The pollers of one line. Most lines have one; a Modbus TCP line with `pipeline: 4` has up to
// four, each with a part of the devices and one exchange at a time as everywhere, over one
// connection (pipeline.h). When the server turns out not to be up to that, one poller takes all
// devices over. Used by gateway/daemon/line_driver.h like a Poller. Sans-I/O.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/line.h"
#include "gateway/lanes/lane_tap.h"
#include "gateway/lanes/pipeline.h"
#include "gateway/poll/poller.h"
#include "gateway/store/point_store.h"

namespace baudgate {

/// The devices of a line in at most `lanes` parts of about the same size, each from its first to
/// behind its last. Devices with one address are never parted.
std::vector<std::pair<std::size_t, std::size_t>> PartDevices(
    const std::vector<config::Device>& devices, std::size_t lanes);

class Lanes {
 public:
  /// As Poller.
  Lanes(const config::Line& line, std::uint32_t first_device, const Poller::FindProtocol& find,
        PointStore& store, PollerListener& listener);
  ~Lanes();

  void Attach(Tap& tap);
  void Recall(std::uint32_t device, std::string memory, Now now);

  void OnOpened(Now now, bool keeps_bit_rate);
  void OnClosed(Now now, Override why = Quality::bad_not_connected);
  /// Before OnClosed, where the other side has ended the connection.
  void OnLost(Now now);
  void OnBytes(View bytes, Now now);
  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;

  void Submit(WriteCommand command, Now now);
  void Submit(RoutedRequest request, Now now);
  void Forget(std::uint64_t client, Now now);
  void SetInUse(std::uint32_t device, bool in_use, Now now);
  void OnEventsKept(std::uint32_t device, const std::string& said, Now now);
  /// See Conversation; what Narrow makes has not heard of it.
  void OnHostClock(bool right);

  void WindUp();
  bool IsWriting() const;
  /// See Ledger.
  bool SilentSince(Instant when) const;

  /// The server is not up to several requests at a time: the connection is to be closed, and this
  /// line told so, then Narrow called.
  bool IsToNarrow() const { return pipeline_ && !pipeline_->verdict().empty(); }
  /// One poller from now on; it knows of its devices what Recall tells it.
  void Narrow(Now now);
  /// For the state of the port: "up to 4 requests at a time", "one request at a time: it …".
  /// Empty: nothing to be said.
  std::string Describe() const;

 private:
  class Lane;

  void MakeOne();
  Poller& PollerOf(std::uint32_t device);
  void SendOut();

  const config::Line& line_;
  const std::uint32_t first_device_;
  const Poller::FindProtocol find_;
  PointStore& store_;
  PollerListener& listener_;
  Tap* tap_ = nullptr;
  std::optional<Pipeline> pipeline_;  // nothing: one poller
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::vector<std::unique_ptr<Lane>> retired_;  // the store knows their lines
  std::unique_ptr<Poller> only_;
  std::vector<Poller*> pollers_;          // of the lanes, or the only one
  std::map<std::uint32_t, bool> in_use_;  // as told
  std::string verdict_;                   // why it is the only one
  Now now_{};
};

}  // namespace baudgate
