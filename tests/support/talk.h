// A conversation and the twin of its device in a test, without poller, line or wire between them:
// what is asked, what a reply means, and whole tasks against the twin.
//
//   Talk talk(DconProtocol(), device);
//   talk.Ask(Poll(0))                           → Request "#01\r"
//   talk.Reply(Poll(0), ToBytes(">+05.880\r"))  → Answer {ok, readings {0: 5.88}}
//   talk.Run(Write(0, true), twin)              both, to the end of the task; the twin answers
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

// ---------------------------------------------------------------- devices

using Settable = std::vector<std::pair<std::string, config::OptionValue>>;

/// Every option that the protocol declares at its fallback, then `given`.
config::Options OptionsOf(const protocols::Protocol& protocol, const Settable& given = {});

config::Point ReadPoint(const std::string& name, const std::string& read, config::Type type,
                        config::Group group = config::Group::fast);
/// Without `read` it is only written.
config::Point WritePoint(const std::string& name, const std::string& read, const std::string& write,
                         config::Type type);

/// Fails the test where the protocol's own checks refuse the device or a point.
config::Device DeviceOf(const protocols::Protocol& protocol, const std::string& address,
                        std::vector<config::Point> points, const Settable& options = {});

// ---------------------------------------------------------------- tasks

protocols::Task Poll(std::size_t query);
protocols::Task Probe();
protocols::Task Write(std::size_t point, Value value);

// ---------------------------------------------------------------- both ends

/// The first whole frame in bytes that silence follows; empty when there is none.
Bytes CutFrame(protocols::FrameRule rule, protocols::Expectation expect, View bytes);

/// What the twin puts on the wire for these bytes; nothing where they are no whole request.
Bytes AskTwin(const protocols::Protocol& protocol, protocols::Twin& twin,
              const config::Options& options, View request, Instant now = {});

/// What comes back for a request, as a test likes it; empty: silence.
using Wire = std::function<Bytes(View request)>;

class Talk {
 public:
  Talk(const protocols::Protocol& protocol, config::Device device);

  protocols::Conversation* operator->() const { return conversation_.get(); }
  const protocols::Protocol& protocol() const { return *protocol_; }
  /// The latest.
  const protocols::Request& request() const { return request_; }

  Result<protocols::Request> Ask(const protocols::Task& task);
  /// `wire` is all that came for the latest request. Without a whole frame in it the request has
  /// failed, and the answer says what the bytes are blamed for.
  protocols::Answer Reply(const protocols::Task& task, View wire);
  protocols::Then Fail(const protocols::Task& task, Outcome outcome);

  /// One exchange. What cannot be asked is `unsupported`.
  protocols::Answer Exchange(const protocols::Task& task, const Wire& wire);
  protocols::Answer Exchange(const protocols::Task& task, View wire);
  protocols::Answer Exchange(const protocols::Task& task, protocols::Twin& twin) {
    return Exchange(task, WireTo(twin));
  }
  /// Exchanges to the end of the task.
  protocols::Answer Run(const protocols::Task& task, const Wire& wire);
  protocols::Answer Run(const protocols::Task& task, protocols::Twin& twin) {
    return Run(task, WireTo(twin));
  }

  Instant now{std::chrono::hours(1)};
  std::vector<Bytes> asked;  ///< all requests, in order

 private:
  Wire WireTo(protocols::Twin& twin) const;

  const protocols::Protocol* protocol_;
  // Conversations keep references to both.
  std::unique_ptr<const config::Device> device_;
  std::unique_ptr<protocols::Bus> bus_;
  std::unique_ptr<protocols::Conversation> conversation_;
  protocols::Request request_;
};

}  // namespace baudgate
