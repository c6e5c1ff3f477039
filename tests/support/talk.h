// `Talk` runs a conversation against a simulated device, without poller, line or wire.
//
//   Talk talk(DconProtocol(), device);
//   talk.Ask(Poll(0))                           → Request "#01\r"
//   talk.Reply(Poll(0), ToBytes(">+05.880\r"))  → Answer {ok, readings {0: 5.88}}
//   talk.Run(Write(0, true), twin)              requests and replies until the task ends
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocols/protocol.h"
#include "tests/support/fixed_values.h"

namespace baudgate {

using Settable = std::vector<std::pair<std::string, config::OptionValue>>;

/// Returns the default of every option that the protocol declares, overwritten by `given`.
config::Options OptionsOf(const protocols::Protocol& protocol, const Settable& given = {});

config::Point ReadPoint(const std::string& name, const std::string& read, config::Type type,
                        config::Group group = config::Group::fast);
/// An empty `read` makes a write-only point.
config::Point WritePoint(const std::string& name, const std::string& read, const std::string& write,
                         config::Type type);

/// Makes a device. Fails the test if the protocol's checks refuse the device or a point.
config::Device DeviceOf(const protocols::Protocol& protocol, const std::string& address,
                        std::vector<config::Point> points, const Settable& options = {});

protocols::Task Poll(std::size_t query);
protocols::Task Probe();
protocols::Task Write(std::size_t point, Value value);

/// Returns the first complete frame of `bytes`, which silence follows; empty: no frame is complete.
Bytes CutFrame(protocols::FrameRule rule, protocols::Expectation expect, View bytes);

/// Returns the simulated device's reply; empty: the bytes are not a complete request, or the
/// simulated device is silent.
Bytes AskTwin(const protocols::Protocol& protocol, protocols::Twin& twin,
              const config::Options& options, View request, Instant now = {});

using Wire = std::function<Bytes(View request)>;

class Talk {
 public:
  Talk(const protocols::Protocol& protocol, config::Device device);

  protocols::Conversation* operator->() const { return conversation_.get(); }
  const protocols::Protocol& protocol() const { return *protocol_; }
  const protocols::Request& request() const { return request_; }

  Result<protocols::Request> Ask(const protocols::Task& task);
  /// Handles `wire`, all bytes that were received. Without a complete frame the request fails.
  protocols::Answer Reply(const protocols::Task& task, View wire);
  protocols::Then Fail(const protocols::Task& task, Outcome outcome);

  protocols::Answer Exchange(const protocols::Task& task, const Wire& wire);
  protocols::Answer Exchange(const protocols::Task& task, View wire);
  protocols::Answer Exchange(const protocols::Task& task, protocols::Twin& twin) {
    return Exchange(task, WireTo(twin));
  }
  protocols::Answer Run(const protocols::Task& task, const Wire& wire);
  protocols::Answer Run(const protocols::Task& task, protocols::Twin& twin) {
    return Run(task, WireTo(twin));
  }

  Instant now{std::chrono::hours(1)};
  std::vector<Bytes> asked;

 private:
  Wire WireTo(protocols::Twin& twin) const;

  const protocols::Protocol* protocol_;
  // The conversation refers to the device and the bus.
  std::unique_ptr<const config::Device> device_;
  std::unique_ptr<protocols::Bus> bus_;
  std::unique_ptr<protocols::Conversation> conversation_;
  protocols::Request request_;
};

}  // namespace baudgate
