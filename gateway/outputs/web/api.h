// `LiveApi` and `PastApi` translate an HTTP request to a request of the control socket, and its
// answer back, so that HTTP and control socket share one implementation (gateway/outputs/control).
// `LiveApi` answers from memory, and `PastApi` from the disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/web/access.h"
#include "gateway/outputs/web/live_streams.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// A query parameter of the URL, and the member of the control request that it becomes (null: the
/// same name).
struct Part {
  const char* query;
  bool number = false;
  const char* member = nullptr;
};

/// Converts an HTTP request to a control request. An error: a parameter is unknown, or its value is
/// not a number.
Result<status::Json> AskOf(const Request& request, std::string_view command,
                           std::initializer_list<Part> parts);

/// Refuses all writes.
class NoWrites final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand) override { return false; }
};

// `LiveApi` answers from memory: states, values, alarms, streams, metrics. It is used by one
// thread.
class LiveApi {
 public:
  static constexpr std::size_t kMostTraces = 8;

  struct Links {
    bus::PointStore& store;
    lines::LineControl& lines;
    status::GatewayInfo info;
    bus::CommandSink* commands = nullptr;      ///< null: every write is refused
    control::ReloadService* reload = nullptr;  ///< null: the gateway does not support reloads
    /// Returns the running configuration as YAML without its secrets; empty: the configuration is
    /// not available.
    std::function<Result<std::string>()> configuration{};
    /// Finds the protocol that decodes the bytes of a trace; empty: bytes are not decoded.
    diagnosis::ProtocolFinder protocol{};
  };
  /// All references must outlive this object. All functions must be called on the thread of `io`.
  LiveApi(const config::Config& config, Links links, asio::io_context& io);

  /// Answers a request. False: the request is not for LiveApi.
  bool Answer(const Request& request, Now now, const Answered& answered);
  /// Acknowledges the alarms that the request names. The event records "web:" and the client's
  /// address as the origin. `answered` can be called later.
  void Acknowledge(const Request& request, const Answered& answered);
  /// Carries out an operation that Access has permitted. `answered` can be called later.
  void Operate(const Operation& operation, const Request& request, const Answered& answered);
  /// Must be called at a reload, with the new configuration and history. Ends all streams.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history);
  /// Sends changes to viewers. Must be called each LivePoints::kTick while there is a viewer.
  /// False: there is no viewer.
  bool Tick(Now now);
  /// Sends the heartbeat of traces. Must be called each second.
  void Beat();
  void EndStreams();

 private:
  /// Sends a request to the code of the control socket.
  void Ask(const status::Json& ask, const bus::Writer& writer, const Answered& answered);

  using Handler = Response (LiveApi::*)(const Request&, Now);
  struct Route {
    std::string_view path;
    Handler handler;
  };
  static const std::vector<Route>& Routes();

  Response Status(const Request& request, Now now);
  Response Points(const Request& request, Now now);
  Response PointsStream(const Request& request, Now now);
  Response Alarms(const Request& request, Now now);
  Response Map(const Request& request, Now now);
  Response Recorded(const Request& request, Now now);
  Response TraceStream(const Request& request, Now now);
  Response Configuration(const Request& request, Now now);
  Response Metrics(const Request& request, Now now);
  Response Asked(const Request& request, std::string_view command,
                 std::initializer_list<Part> parts, Now now);
  diagnosis::Decoders DecodersFor(const status::Target& target, const std::string& device) const;
  Result<std::uint32_t> DeviceNamed(const std::string& name) const;

  std::shared_ptr<const config::Config> config_;
  Links links_;
  asio::io_context& io_;
  NoWrites no_writes_;
  control::RequestHandler handler_;
  LivePoints points_;
  std::vector<std::weak_ptr<LiveTrace>> traces_;
};

// `PastApi` answers from the disk: events and history. It runs on another thread than LiveApi, so
// that a slow disk does not delay viewers of current data.
class PastApi {
 public:
  /// All references must outlive this object. All functions but Apply must be called on the thread
  /// of `io`.
  PastApi(const config::Config& config, const bus::PointStore& store, lines::LineControl& lines,
          status::GatewayInfo info, asio::io_context& io);

  /// Answers a request. False: the request is not for PastApi.
  bool Answer(const Request& request, Now now, const Answered& answered);
  static bool Has(std::string_view path);
  /// Must be called at a reload; any thread may call it. A request that is being answered still
  /// uses the old history.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history) {
    handler_.Apply(std::move(config), std::move(history));
  }

 private:
  class Download;

  Response Events(const Request& request, Now now);
  Response History(const Request& request, Now now);
  Response HistoryCsv(const Request& request, Now now);
  Response EventsCsv(const Request& request, Now now);
  Response Writes(const Request& request, Now now);
  Response Csv(std::vector<status::Json> asks, std::string name, std::string head,
               std::string (*row)(const status::Json& record), Now now);
  std::string Page(const status::Json& ask, Now now);

  asio::io_context& io_;
  NoWrites no_writes_;
  control::RequestHandler handler_;
  // Downloads hold weak pointers to this pointer, so they detect that this object was destroyed.
  std::shared_ptr<PastApi*> alive_ = std::make_shared<PastApi*>(this);
};

}  // namespace baudgate::web
