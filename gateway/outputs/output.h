// `Output` is the interface of the parts that give values and states of the gateway to clients:
// Modbus, DDS, the web page and the control socket. The daemon has a list of outputs
// (gateway/daemon/output_list.cpp) and calls them in the order of the list:
//
//   start   Open, before the first request to a device; SetHistory and Begin, when the lines run
//   reload  Examine, CountClients; Prepare, which may fail; Apply; SetHistory
//   stop    StopRequests for each output; when the lines have ended, Stop for each output
//
// Any thread may call Section and Metrics at any time. README.md in this folder describes how to
// add an output.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstddef>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/series.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::outputs {

/// An upper estimate of the file descriptors that an output uses at the same time.
struct DescriptorNeeds {
  std::size_t clients = 0;  ///< connections of clients; reduced if the system's limit is too low
  std::size_t others = 0;   ///< ports, sockets and files; never reduced
  /// Connections of web viewers; if the system's limit is too low, at most an eighth of it.
  std::size_t viewers = 0;

  std::size_t all() const { return clients + others + viewers; }
  DescriptorNeeds& operator+=(const DescriptorNeeds& more) {
    clients += more.clients;
    others += more.others;
    viewers += more.viewers;
    return *this;
  }
};

class Output {
 public:
  using Configuration = std::shared_ptr<const config::Config>;
  using Json = nlohmann::ordered_json;

  /// The ports that Prepare has opened for a new configuration. The destructor closes them.
  struct Prepared {
    virtual ~Prepared() = default;
    std::vector<std::string> troubles;  ///< sentences: why the new configuration cannot be served
  };

  struct Wish {
    std::string line;  ///< only the parts of this line are wanted; empty: all parts
    Now now{};
  };

  virtual ~Output() = default;
  Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Returns the key in the status document, e.g. "modbus".
  virtual std::string_view name() const = 0;

  /// Opens the ports. An error ends the start of the gateway.
  virtual Status Open(const Configuration& /*config*/) { return {}; }
  /// Starts to serve clients, unless Open has already started.
  virtual Status Begin(const Configuration& /*config*/) { return {}; }

  /// Adds to `settings` the changes in `next` that a comparison of the keys does not find (e.g. the
  /// content of a token file), and to `restart` the changes that only a restart can apply.
  virtual void Examine(const config::Config& /*next*/, std::vector<std::string>& /*settings*/,
                       std::vector<std::string>& /*restart*/) const {}
  /// Adds the connected clients to the count of their listener (config::Listener::Address).
  virtual void CountClients(std::map<std::string, std::size_t>& /*by_listener*/) const {}
  /// Opens the ports that `next` needs in addition to the open ones. Clients notice nothing.
  virtual std::unique_ptr<Prepared> Prepare(const config::Config& /*next*/) {
    return std::make_unique<Prepared>();
  }
  /// Applies the new configuration; the store already contains its devices. Returns sentences about
  /// parts that could not be applied.
  virtual std::vector<std::string> Apply(const Configuration& /*config*/,
                                         std::unique_ptr<Prepared> /*prepared*/) {
    return {};
  }
  /// Replaces the history; null: there is no history. The previous history is no longer used when
  /// SetHistory returns.
  virtual void SetHistory(const Configuration& /*config*/,
                          const std::shared_ptr<const history::HistorySource>& /*history*/) {}

  /// After StopRequests, no request reaches the lines through this output. A second call does
  /// nothing.
  virtual void StopRequests() {}
  /// Ends the output, after the lines have ended or when one of them hangs: informs clients, and
  /// closes everything that StopRequests has left open. A second call does nothing.
  virtual void Stop() {}

  /// Returns e.g. "Modbus TCP on 0.0.0.0:502" for the log; empty: nothing is served. Must not be
  /// called after StopRequests.
  virtual std::string Summary() { return {}; }
  /// Returns the output's part of the status document: null if the output is off; nothing if the
  /// output has no part.
  virtual std::optional<Json> Section(const Wish& /*wish*/) const { return std::nullopt; }
  virtual std::vector<Series> Metrics() const { return {}; }
  /// Returns the event loop of the output's thread, which the daemon monitors; null: no thread.
  virtual asio::io_context* loop() { return nullptr; }
};

using OutputList = std::vector<std::unique_ptr<Output>>;

}  // namespace baudgate::outputs
