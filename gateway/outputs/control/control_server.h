// The local control socket of a running gateway: accepts clients on a unix stream socket and hands
// their requests to gateway/outputs/control/request_handler.h. One JSON object a line, both ways.
// RequestLines cuts bytes into lines, TraceStream streams a trace, and ControlSession is one
// client. ControlOutput has them on a thread of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <asio/io_context.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/outputs/control/request.h"
#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/output.h"
#include "transports/loop_thread.h"

namespace baudgate::control {

// Cuts what a client sends into request lines. Memory is bounded: a line has a longest length.
class RequestLines {
 public:
  explicit RequestLines(std::size_t longest) : longest_(longest) {}

  /// Where the next bytes go.
  std::array<char, 4096>& space() { return space_; }
  /// So many were put there.
  void Commit(std::size_t count) { text_.append(space_.data(), count); }

  /// The first line, even if its end is not here yet.
  bool IsTooLong() const { return std::min(text_.find('\n'), text_.size()) > longest_; }
  /// The first line, without its end; empty: its end is not here yet.
  std::optional<std::string> Take() {
    const auto end = text_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = text_.substr(0, end);
    text_.erase(0, end + 1);
    return line;
  }

 private:
  const std::size_t longest_;
  std::array<char, 4096> space_{};
  std::string text_;
};

// The trace of a line for one client: the records that the client wants.
class TraceStream {
 public:
  TraceStream(TraceWish wish, std::shared_ptr<records::TraceQueue> queue)
      : wish_(std::move(wish)), queue_(std::move(queue)) {}

  std::uint32_t line() const { return wish_.line; }
  /// The records since the last call, one a line; empty: there are none. Records that nobody takes
  /// fill the queue, which then drops some and counts them.
  std::string Take();

 private:
  TraceWish wish_;
  std::shared_ptr<records::TraceQueue> queue_;
};

// One client of the control socket: takes its request lines one after the other, or streams a trace
// to it. All on the server's thread. Memory is bounded whatever the client does: a request has a
// longest length, an answer must be read in time, a trace that is not read loses records.
struct Limits {
  std::size_t clients = 16;
  /// Beyond them, for clients with one request, such as a confirmation: without traces.
  std::size_t short_clients = 2;
  std::size_t request = 4096;  ///< bytes of one request line
  Duration patience = 10s;     ///< for a whole request, and for a whole answer
  Duration disk = 5s;          ///< for an answer that is read from the disk
  Duration look = 5s;          ///< so often it is looked whether the socket file is there
};

class ControlSession : public std::enable_shared_from_this<ControlSession> {
 public:
  using Socket = asio::local::stream_protocol::socket;
  /// `service` outlives every session that is not closed; `closed` is called once, at the end.
  /// `may_trace`: else a trace is refused as too many.
  ControlSession(Socket socket, RequestHandler& service, const Limits& limits, bool may_trace,
                 std::function<void(ControlSession&)> closed);

  /// The error for a client beyond the limit.
  static std::string TooMany(const Limits& limits);

  void Start();
  /// A trace of a line that is gone ends.
  void OnReload(const config::Config& config);
  /// Between two requests, or before its first: it may make room for others.
  bool is_idle() const { return !asked_ && out_.empty() && !trace_; }
  /// They rise.
  std::uint64_t number() const { return client_.number; }
  /// `farewell`: a last line for a client that follows a trace.
  void Close(const std::string& farewell = {});

 private:
  void Receive();
  void OnReceived(std::size_t count);
  void Handle(std::string_view request);
  void Send(std::string text, bool last = false);
  void OnSent(bool last);
  void StartTrace(const TraceWish& wish);
  void SendRecords();
  void WatchEnd();
  void BePatient(Duration patience);
  void OnImpatience();

  Socket socket_;
  asio::steady_timer patience_;
  RequestHandler& service_;
  const Limits limits_;
  std::function<void(ControlSession&)> on_closed_;
  const std::shared_ptr<std::atomic<bool>> left_;  // the client has left
  const bus::Writer client_;
  RequestLines in_;
  std::string out_;       // the socket has it; empty: nothing is being sent
  bool asked_ = false;    // its request has no answer yet
  bool watched_ = false;  // WatchEnd is under way
  std::string late_;      // see Reply
  const bool may_trace_;
  std::optional<TraceStream> trace_;
  bool closed_ = false;
};

class ControlServer {
 public:
  /// All references outlive the server; `io` also outlives the lines, whose threads wake traces,
  /// and no longer runs when the server is destroyed.
  ControlServer(const config::Config& config, const bus::PointStore& store,
                lines::LineControl& control, bus::CommandSink& sink, status::GatewayInfo info,
                asio::io_context& io, const Limits& limits = {});
  ~ControlServer();

  /// Binds config.socket, or the first of the default places that can be had. A socket file that a
  /// dead process left is replaced, one that answers is not. The error names every place tried.
  Status Listen();
  /// See RequestHandler; before Listen.
  void SetReload(ReloadService& service) { service_.SetReload(service); }
  /// A reload, on the thread of `io`: `config` is the one by now. Traces of lines that are gone
  /// end.
  void Apply(const std::shared_ptr<const config::Config>& config,
             std::shared_ptr<const history::HistorySource> history);
  /// On the thread of `io`, or when it does not run. Ends all traces and removes the socket file.
  void Stop();

  /// The path of the socket file, once it listens.
  const std::string& path() const { return path_; }

 private:
  Status BindAnywhere();
  Status Bind(const std::string& path);
  /// Looks every few seconds whether the socket file is there, and binds again if it was removed.
  void Watch();
  void Rebind();
  void Accept();
  void MakeRoom();
  void HoldReserve();
  void Welcome(ControlSession::Socket socket);

  const config::Config& config_;
  Limits limits_;
  RequestHandler service_;
  asio::local::stream_protocol::acceptor acceptor_;
  asio::steady_timer retry_;
  asio::steady_timer look_;
  std::map<ControlSession*, std::shared_ptr<ControlSession>> sessions_;
  int reserve_ = -1;  // a descriptor for one client more where the process has none left
  std::string path_;
  std::uint64_t inode_ = 0;  // of the socket file, so that only our own is removed
  std::string trouble_;      // why it cannot be bound again, as it was said last
  bool stopped_ = false;
};

}  // namespace baudgate::control

namespace baudgate::control {

/// The control socket as an output of the gateway, on a thread of its own: long answers must not
/// delay registers.
class ControlOutput final : public outputs::Output {
 public:
  struct Links {
    const bus::PointStore& store;
    lines::LineControl& lines;
    bus::CommandSink& commands;
    status::GatewayInfo info;
    control::ReloadService* reload = nullptr;  ///< null: nothing is reloaded
  };
  /// All of `links` and `config`, that of the start, outlive it.
  ControlOutput(const config::Config& config, const Links& links);
  ~ControlOutput() override { StopRequests(); }

  std::string_view name() const override { return "control"; }
  /// Without a socket the gateway polls all the same: the log says why there is none.
  Status Begin(const Configuration& config) override;
  void SetHistory(const Configuration& config,
                  const std::shared_ptr<const history::HistorySource>& history) override;
  void StopRequests() override;
  asio::io_context* loop() override { return listens_ ? &loop_.io() : nullptr; }

 private:
  transports::LoopThread loop_{"control"};
  control::ControlServer server_;
  bool listens_ = false;
};

}  // namespace baudgate::control
