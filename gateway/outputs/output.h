// An output: a way in which the gateway gives away what it knows, such as Modbus, DDS, the web page
// and the control socket. The daemon has a list of outputs (gateway/daemon/daemon.cpp) and calls
// them in the order of the list:
//
//   at the start    Open, before the first device is asked; SetHistory and Begin, when the lines
//   run at a reload     Examine, ClientsAt; Prepare, which may fail; Apply; SetHistory at the stop
//   StopRequests for each; when the lines have ended, Stop for each at any time     Section for the
//   status document, Metrics for /metrics
//
// A new output is a folder beside this file, which docs/modules.txt names; its configuration
// (config/model/outputs.h, config/model/config.h) with a reader (config/outputs.cpp); and one line
// in the list. docs/architecture.md, "Where is it?", says where outputs are named.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstddef>
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

namespace baudgate {

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
  /// The clients that this listener has now; see config::Listener::Place.
  virtual std::size_t ClientsAt(const std::string& /*place*/) const { return 0; }
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

}  // namespace baudgate
