// One client of the control socket: takes its request lines one after the other, or streams a trace
// to it. All on the server's thread. Memory is bounded whatever the client does: a request has a
// longest length, an answer must be read in time, a trace that is not read loses records.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/control/request_lines.h"
#include "gateway/outputs/control/trace_stream.h"

namespace baudgate::control {

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
  const Writer client_;
  RequestLines in_;
  std::string out_;       // the socket has it; empty: nothing is being sent
  bool asked_ = false;    // its request has no answer yet
  bool watched_ = false;  // WatchEnd is under way
  std::string late_;      // see Reply
  const bool may_trace_;
  std::optional<TraceStream> trace_;
  bool closed_ = false;
};

}  // namespace baudgate::control
