// What is answered out of memory: states, values, alarms, streams, metrics. One thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <vector>

#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/web/ask.h"
#include "gateway/outputs/web/live_points.h"
#include "gateway/outputs/web/live_trace.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

class LiveApi {
 public:
  static constexpr std::size_t kMostTraces = 8;

  struct Links {
    PointStore& store;
    LineControl& lines;
    control::GatewayInfo info;
    /// The YAML in force, without its secrets; empty: not known.
    std::function<Result<std::string>()> configuration{};
    ProtocolFinder protocol{};  ///< of what goes over a line; empty: only bytes are shown
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
  Decoders DecodersFor(const control::Target& target, const std::string& device) const;
  Result<std::uint32_t> DeviceNamed(const std::string& name) const;

  std::shared_ptr<const config::Config> config_;
  Links links_;
  asio::io_context& io_;
  NoWrites no_writes_;
  control::RequestHandler handler_;
  LivePoints points_;
  std::vector<std::weak_ptr<LiveTrace>> traces_;
};

}  // namespace baudgate::web
