// An output: a way in which the gateway gives away what it knows, such as Modbus, DDS, the web page
// and the control socket. The daemon has a list of outputs (gateway/daemon/output_list.cpp) and
// calls them in the order of the list:
//
//   start   Open, before the first device is asked; SetHistory and Begin, when the lines run
//   reload  Examine, CountClients; Prepare, which may fail; Apply; SetHistory
//   stop    StopRequests for each; when the lines have ended, Stop for each
//
// At any time, from any thread: Section for the status document, Metrics for /metrics.
// README.md beside this file says how to add an output.
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

/// Files that an output may have open at once, generously.
struct DescriptorNeeds {
  std::size_t clients = 0;  ///< connections of clients; if the system allows less, a part of them
  std::size_t others = 0;   ///< ports, sockets, files: always
  std::size_t viewers = 0;  ///< connections of viewers; if the system allows less, an eighth of it

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

  /// What Prepare has opened in advance. If it is dropped, its ports close.
  struct Prepared {
    virtual ~Prepared() = default;
    std::vector<std::string> troubles;  ///< why the new configuration cannot be served
  };

  /// What is asked for by the status document.
  struct Wish {
    std::string line;  ///< what belongs to this line; empty: everything
    Now now{};
  };

  virtual ~Output() = default;
  Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Its key in the status document: "modbus".
  virtual std::string_view name() const = 0;

  /// Opens its ports. The error ends the start of the gateway.
  virtual Status Open(const Configuration& /*config*/) { return {}; }
  /// Serves from now on, if Open has not begun already.
  virtual Status Begin(const Configuration& /*config*/) { return {}; }

  /// Adds what `next` changes beside its keys to `settings`, and what only a restart can change to
  /// `restart`.
  virtual void Examine(const config::Config& /*next*/, std::vector<std::string>& /*settings*/,
                       std::vector<std::string>& /*restart*/) const {}
  /// Adds the clients that are connected now to the count of their listener
  /// (config::Listener::Place).
  virtual void CountClients(std::map<std::string, std::size_t>& /*by_listener*/) const {}
  /// Opens what `next` needs beside what is open. Changes nothing for clients.
  virtual std::unique_ptr<Prepared> Prepare(const config::Config& /*next*/) {
    return std::make_unique<Prepared>();
  }
  /// Takes the new configuration; the store has its devices. Returns what could not be applied.
  virtual std::vector<std::string> Apply(const Configuration& /*config*/,
                                         std::unique_ptr<Prepared> /*prepared*/) {
    return {};
  }
  /// The history that may be read from now on; null: none. Done when it returns.
  virtual void SetHistory(const Configuration& /*config*/,
                          const std::shared_ptr<const history::HistorySource>& /*history*/) {}

  /// No request reaches the lines through this output after it returns. Idempotent.
  virtual void StopRequests() {}
  /// The lines have ended, or one of them hangs: says so to clients and closes what StopRequests
  /// has left open. Idempotent.
  virtual void Stop() {}

  /// For the log: "Modbus TCP on 0.0.0.0:502"; empty: nothing is served. Not after StopRequests.
  virtual std::string Summary() { return {}; }
  /// From any thread: its part of the status document, null while it is off; empty: it has none.
  virtual std::optional<Json> Section(const Wish& /*wish*/) const { return std::nullopt; }
  /// From any thread.
  virtual std::vector<Series> Metrics() const { return {}; }
  /// Its thread, which is watched; null: it has none.
  virtual asio::io_context* loop() { return nullptr; }
};

using OutputList = std::vector<std::unique_ptr<Output>>;

}  // namespace baudgate::outputs
