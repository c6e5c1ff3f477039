// `MakeTcpClient` makes a transport over raw TCP to a serial server. ParseTcpPort parses addresses,
// and HostNames looks up host names.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/result.h"
#include "transports/transport.h"

namespace baudgate::transports {

// The host and the port number in "tcp://host:port" or "tls://host:port", which is the port of a
// line. An IPv6 address is in brackets there.
struct TcpAddress {
  std::string host;  ///< name or address, without brackets
  std::uint16_t port = 0;
};

Result<TcpAddress> ParseTcpPort(std::string_view port);

// HostNames looks up addresses on its own threads, because the system's look-up blocks, for half a
// minute if a name server is dead. Results are passed to the caller's loop.

/// Simultaneous requests for one host share a look-up. Threads exist only while there are hosts to
/// look up.
class HostNames {
 public:
  using Addresses = std::vector<asio::ip::address>;
  /// Looks up a host; it is called on any thread, and can block without a time limit. The error is
  /// the system's message.
  using LookUp = std::function<Result<Addresses>(const std::string& host)>;
  using Done = std::function<void(const Result<Addresses>&)>;

  /// The maximum number of concurrent look-ups with a waiting caller; further look-ups wait.
  static constexpr std::size_t kMostAwaited = 4;
  /// A host is given up when no caller waits for its running look-up any more. The look-up then
  /// does not count for kMostAwaited, but at most kMostAwaited + kMostHanging look-ups run. A host
  /// that was given up is looked up again only while fewer than kMostRetried look-ups of such hosts
  /// run.
  static constexpr std::size_t kMostHanging = 12;
  static constexpr std::size_t kMostRetried = 4;

  /// The caller holds a ticket while it waits. After the ticket is destroyed, `done` is not called
  /// any more. A ticket must be used on the thread of the loop only.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&& other) noexcept { *this = std::move(other); }
    Ticket& operator=(Ticket&& other) noexcept;
    ~Ticket() { Drop(); }

   private:
    friend class HostNames;
    void Drop();
    std::function<void()> drop_;
  };

  explicit HostNames(LookUp look_up);
  HostNames(const HostNames&) = delete;
  HostNames& operator=(const HostNames&) = delete;

  /// Looks up `host`. `done` is called once, on the thread of `io`, never inside this call. The
  /// loop must outlive the ticket.
  [[nodiscard]] Ticket Ask(const std::string& host, asio::io_context& io, Done done);

  /// Returns the instance that the whole process shares. It uses the system's resolver.
  static HostNames& OfProcess();

 private:
  struct Waiter;
  struct State;
  std::shared_ptr<State> state_;  // shared with the threads, which may outlive this object
};

/// `port` is "tcp://host:port", or "tls://host:port" with the files `tls`; with an invalid text,
/// every Open fails. `listener` and `names` must outlive the transport. A server whose network path
/// died silently is noticed within about 25 s. A server that answers TCP but has lost its serial
/// side is not noticed here: the line must notice it, then call Close and Open.
std::unique_ptr<Transport> MakeTcpClient(std::string port, const config::SerialSettings& serial,
                                         const config::TlsFiles& tls, asio::io_context& io,
                                         TransportListener& listener,
                                         HostNames& names = HostNames::OfProcess());

}  // namespace baudgate::transports
