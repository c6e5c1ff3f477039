// The local control socket of a running gateway: accepts clients on a unix stream socket and hands
// their requests to gateway/outputs/control/request_handler.h. One JSON object a line, both ways.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/steady_timer.hpp>
#include <map>
#include <memory>
#include <string>

#include "gateway/outputs/control/control_session.h"
#include "gateway/outputs/control/request_handler.h"

namespace baudgate::control {

class ControlServer {
 public:
  /// All references outlive the server; `io` also outlives the lines, whose threads wake traces,
  /// and no longer runs when the server is destroyed.
  ControlServer(const config::Config& config, const PointStore& store, LineControl& control,
                CommandSink& sink, GatewayInfo info, asio::io_context& io,
                const Limits& limits = {});
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
