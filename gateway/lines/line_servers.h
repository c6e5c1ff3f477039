// The servers for the port of one line: the configured one, and one by hand for a while
// (`baudgate release --tcp`). On the loop of the line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <string>

#include "config/model/line.h"
#include "gateway/lines/port_loan.h"
#include "gateway/lines/serial_server/server.h"

namespace baudgate {

class LineServers {
 public:
  /// All outlive it. `owner`: of the port; clients ask it for `loan`.
  LineServers(asio::io_context& io, const config::Line& line, serial_server::PortOwner& owner,
              PortLoan& loan)
      : io_(io), line_(line), owner_(owner), loan_(loan) {}

  void Start();
  /// `why`: "the gateway stops".
  void Stop(const std::string& why);
  /// Until Withdraw, which is due after `time`.
  void Offer(config::PortServer server, Duration time, Now now);
  /// Ends the offer: no client can connect there any more, and one that has the port loses it.
  void Withdraw(const std::string& why, Now now);

 private:
  void Close(const std::string& why);
  std::unique_ptr<serial_server::Server> Make(const config::PortServer& server,
                                              serial_server::Server::Use use);

  asio::io_context& io_;
  const config::Line& line_;
  serial_server::PortOwner& owner_;
  PortLoan& loan_;
  std::unique_ptr<serial_server::Server> server_;   // as configured; null: there is none
  std::unique_ptr<serial_server::Server> offered_;  // by hand; null: there is none
  config::PortServer offer_;                        // where that is
};

}  // namespace baudgate
