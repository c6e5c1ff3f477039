// A request by HTTP as one of the control socket, and its answer the way back: what both can tell
// is made in one place (gateway/outputs/control). LiveApi answers from memory, and PastApi from the
// disk.
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
#include "gateway/outputs/web/live_streams.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

/// A member of the request that is taken from the address, where it is there.
struct Part {
  const char* query;
  bool number = false;
  const char* member = nullptr;  ///< null: as in the address
};

/// The error names a number that is none, or a member that there is not.
Result<status::Json> AskOf(const Request& request, std::string_view command,
                           std::initializer_list<Part> parts);

/// Nothing can be written through it.
class NoWrites final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand) override { return false; }
};

// What is answered out of memory: states, values, alarms, streams, metrics. One thread.
class LiveApi {
 public:
  static constexpr std::size_t kMostTraces = 8;

  struct Links {
    bus::PointStore& store;
    lines::LineControl& lines;
    status::GatewayInfo info;
    /// The YAML in force, without its secrets; empty: not known.
    std::function<Result<std::string>()> configuration{};
    diagnosis::ProtocolFinder
        protocol{};  ///< of what goes over a line; empty: only bytes are shown
  };
  /// All of it outlives this; everything is called on the thread of `io`.
  LiveApi(const config::Config& config, Links links, asio::io_context& io);

  /// False: this is none of its requests.
  bool Answer(const Request& request, Now now, const Answered& answered);
  /// `by`: the person that acknowledges.
  void Acknowledge(const Request& request, const Answered& answered);
  /// A reload: `config` and `history` are those by now. Streams of points end, and traces.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history);
  /// Each LivePoints::kTick while there is a viewer; false: there is none.
  bool Tick(Now now);
  /// Sends the heartbeat of traces; called each second.
  void Beat();
  void EndStreams();

 private:
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

// What is answered from the disk: events and history. On a thread of its own, so that a disk that
// is slow does not hold up viewers of the present.
class PastApi {
 public:
  /// All of it outlives this; but for Apply everything is called on the thread of `io`.
  PastApi(const config::Config& config, const bus::PointStore& store, lines::LineControl& lines,
          status::GatewayInfo info, asio::io_context& io);

  /// False: this is none of its requests.
  bool Answer(const Request& request, Now now, const Answered& answered);
  static bool Has(std::string_view path);
  /// A reload, from any thread. A page that is being read goes on with what it has.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history) {
    handler_.Apply(std::move(config), std::move(history));
  }

 private:
  class Download;

  Response Events(const Request& request, Now now);
  Response History(const Request& request, Now now);
  Response HistoryCsv(const Request& request, Now now);
  /// One page of the control socket's `history`.
  std::string Page(const status::Json& ask, Now now);

  asio::io_context& io_;
  NoWrites no_writes_;
  control::RequestHandler handler_;
  std::shared_ptr<PastApi*> alive_ = std::make_shared<PastApi*>(this);  // for downloads
};

}  // namespace baudgate::web
