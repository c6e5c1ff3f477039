// Raw TCP to a serial server as a transport: bytes come from and go to the server's serial port.
// ParseTcpPort reads addresses, and HostNames looks up host names.
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

// Reads "tcp://host:port" of a line's configuration; IPv6 addresses stand in brackets.
struct TcpAddress {
  std::string host;  ///< name or address, without brackets
  std::uint16_t port = 0;
};

/// Whether the text claims to be such an address, right or wrong.
bool IsTcpPort(std::string_view port);

Result<TcpAddress> ParseTcpPort(std::string_view port);

// Looks up the addresses of serial servers in threads of its own: the system's look-up blocks, for
// half a minute where a name server is dead. Asked by tcp_client.cpp; answers come on the asker's
// loop.

/// A host that is asked for by many is looked up once. Threads exist only while there is something
/// to look up.
class HostNames {
 public:
  using Addresses = std::vector<asio::ip::address>;
  /// Blocks for as long as it likes, in any thread; an error is the system's own words.
  using LookUp = std::function<Result<Addresses>(const std::string& host)>;
  using Done = std::function<void(const Result<Addresses>&)>;

  /// The most look-ups with a waiting caller that run at a time; further ones queue.
  static constexpr std::size_t kMostAwaited = 4;
  /// A host is given up when no caller waits any more. So many look-ups of such
  /// hosts may hang beside those above; their names are begun again only while fewer than
  /// kMostRetried do.
  static constexpr std::size_t kMostHanging = 12;
  static constexpr std::size_t kMostRetried = 4;

  /// Its holder waits for an answer; destroyed: it waits no more, and `done` is not called. Belongs
  /// to the thread of the loop.
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

  /// `done` is called once, on the thread of `io`, never from within this call. The loop outlives
  /// the ticket.
  [[nodiscard]] Ticket Ask(const std::string& host, asio::io_context& io, Done done);

  /// Those of the process, by the system's resolver.
  static HostNames& OfProcess();

 private:
  struct Waiter;
  struct State;
  std::shared_ptr<State> state_;  // also the threads', which may outlive this
};

/// `port` is "tcp://host:port"; one that cannot be read fails at every Open. `listener` outlives
/// the transport. A server whose network path died silently is noticed within about 25 s; one that
/// answers TCP but lost its serial side is for the line to notice: Close and Open again.
/// `names` outlives the transport.
std::unique_ptr<Transport> MakeTcpClient(std::string port, const config::SerialSettings& serial,
                                         asio::io_context& io, TransportListener& listener,
                                         HostNames& names = HostNames::OfProcess());

}  // namespace baudgate::transports
