// `ControlServer` is the local control socket of a running gateway: it accepts clients on a unix
// stream socket and passes their requests to gateway/outputs/control/request_handler.h. Each
// request and each answer is a JSON object in one line. ControlOutput runs the server on a thread.
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
#include "gateway/outputs/users/user_file.h"
#include "transports/loop_thread.h"

namespace baudgate::control {

// Splits the bytes from a client into request lines of bounded length.
class RequestLines {
 public:
  explicit RequestLines(std::size_t longest) : longest_(longest) {}

  std::array<char, 4096>& space() { return space_; }
  void Commit(std::size_t count) { text_.append(space_.data(), count); }

  /// True if the first line is too long, even if its end has not arrived yet.
  bool IsTooLong() const { return std::min(text_.find('\n'), text_.size()) > longest_; }
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

// TraceStream filters the records of a trace (gateway/records/trace/trace_text.h) by the client's
// TraceWish and formats them.
class TraceStream {
 public:
  TraceStream(TraceWish wish, std::shared_ptr<records::TraceQueue> queue)
      : wish_(std::move(wish)), queue_(std::move(queue)) {}

  std::uint32_t line() const { return wish_.line; }
  /// Returns the matching records since the last call as text, one per line; empty: there are no
  /// new records. If Take is not called in time, TraceQueue drops records, and a note in the trace
  /// tells how many.
  std::string Take();

 private:
  TraceWish wish_;
  std::shared_ptr<records::TraceQueue> queue_;
};

// Limits of a session's memory and time.
struct Limits {
  std::size_t clients = 16;
  /// Clients that are accepted in addition to `clients`, e.g. for `baudgate confirm` while clients
  /// with traces use up `clients`. They get no trace.
  std::size_t short_clients = 2;
  std::size_t request = 4096;  ///< longest request line in bytes
  /// Time for the client to send a whole request or to read a whole answer, and for the gateway to
  /// answer. Then the session ends.
  Duration patience = 10s;
  Duration disk = 5s;  ///< time for an answer that is read from the disk (replaces `patience`)
  Duration look = 5s;  ///< interval between two checks of the socket file
};

/// ControlSession answers one client's requests one after the other, or streams a trace. Only the
/// server's thread may call it. A client that does not read its trace loses records.
class ControlSession : public std::enable_shared_from_this<ControlSession> {
 public:
  using Socket = asio::local::stream_protocol::socket;
  /// `service` must outlive the open session. `closed` is called once, when the session ends. If
  /// `may_trace` is false, a request for a trace is answered with TooMany().
  ControlSession(Socket socket, RequestHandler& service, users::UserDirectory& users,
                 const Limits& limits, bool may_trace, std::function<void(ControlSession&)> closed);

  static std::string TooMany(const Limits& limits);

  void Start();
  /// Ends the client's trace if a reload has removed or restarted the traced line.
  void OnReload(const config::Config& config);
  /// True if the client waits for no answer and follows no trace, so it can be disconnected to
  /// accept another client.
  bool is_idle() const { return !asked_ && out_.empty() && !trace_; }
  /// Returns the client's number. A client that connects later has a higher number.
  std::uint64_t number() const { return client_.number; }
  /// `farewell`: a last line that is sent if the client follows a trace; empty: no line.
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
  // True after the session has ended. The client's queued writes share it, and are then not
  // started.
  const std::shared_ptr<std::atomic<bool>> left_;
  users::UserDirectory& users_;
  bus::Writer client_;
  RequestLines in_;
  std::string out_;
  bool asked_ = false;  // the client's request has no answer yet
  bool watched_ = false;
  std::string late_;  // answer that is sent when the disk takes too long (Reply::late)
  const bool may_trace_;
  std::optional<TraceStream> trace_;
  bool closed_ = false;
};

class ControlServer {
 public:
  /// All references must outlive the server. `io` must also outlive the lines, because their
  /// threads post to it when a trace has new records. `io` must not run when the server is
  /// destroyed.
  ControlServer(const config::Config& config, const bus::PointStore& store,
                lines::LineControl& control, bus::CommandSink& sink, status::GatewayInfo info,
                asio::io_context& io, const Limits& limits = {});
  ~ControlServer();

  /// Binds config.socket or, if it is empty, the first default path that is usable. Replaces a
  /// socket file on which no process listens; if a process listens, the path is not usable. The
  /// error lists every path that was tried.
  Status Listen();
  /// To be called before Listen (see RequestHandler::SetReload).
  void SetReload(ReloadService& service) { service_.SetReload(service); }
  /// Applies a reload, on the thread of `io`. Ends the traces of removed lines.
  void Apply(const std::shared_ptr<const config::Config>& config,
             std::shared_ptr<const history::HistorySource> history);
  /// Ends all sessions and removes the socket file. To be called on the thread of `io`, or when
  /// `io` does not run.
  void Stop();

  const std::string& path() const { return path_; }

 private:
  Status BindAnywhere();
  Status Bind(const std::string& path);
  /// Checks the socket file every few seconds, and binds again if the file was removed.
  void Watch();
  void Rebind();
  void Accept();
  void MakeRoom();
  void HoldReserve();
  void Welcome(ControlSession::Socket socket);
  status::GatewayInfo WithUsers(status::GatewayInfo info);

  const config::Config& config_;
  Limits limits_;
  users::UserDirectory users_;
  RequestHandler service_;
  asio::local::stream_protocol::acceptor acceptor_;
  asio::steady_timer retry_;
  asio::steady_timer look_;
  std::map<ControlSession*, std::shared_ptr<ControlSession>> sessions_;
  // A spare descriptor. It is closed when the process has no descriptor left, so that a client can
  // be accepted.
  int reserve_ = -1;
  std::string path_;
  std::uint64_t inode_ = 0;  // inode of the socket file, so that only our own file is removed
  // The last logged reason why binding again failed; empty: binding has not failed.
  std::string trouble_;
  bool stopped_ = false;
};

}  // namespace baudgate::control

namespace baudgate::control {

/// Runs the control socket on a thread of its own, because long answers must not delay Modbus
/// registers.
class ControlOutput final : public outputs::Output {
 public:
  struct Links {
    const bus::PointStore& store;
    lines::LineControl& lines;
    bus::CommandSink& commands;
    status::GatewayInfo info;
    control::ReloadService* reload = nullptr;
  };
  /// `config` is the configuration at the start. It and all references must outlive this object.
  ControlOutput(const config::Config& config, const Links& links);
  ~ControlOutput() override { StopRequests(); }

  std::string_view name() const override { return "control"; }
  /// Begin returns no error: if no socket can be bound, the gateway runs without one and logs the
  /// reason.
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
