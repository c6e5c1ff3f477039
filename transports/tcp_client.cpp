// Look-up, connection with a deadline, then bytes to and from the socket.
// SPDX-License-Identifier: Apache-2.0
#include "transports/tcp_client.h"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <asio/connect.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <vector>

#include "gateway/base/time.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"
#include "transports/stream_pump.h"
#include "transports/tcp_address.h"
#include "transports/tcp_watch.h"

namespace baudgate {
namespace {

using asio::ip::tcp;

constexpr std::chrono::seconds kConnectTimeout{5};  // name look-up and connection together
/// A peer that is well may take so long to acknowledge (RFC 1122, 4.2.3.2). Small serial servers do
/// take 250 ms, and a request to a silent device may be given up sooner than that.
constexpr Duration kAckLimit = 500ms;

/// A peer that vanished must be noticed, and a connection that is given up must not go on sending:
/// whoever closes it, were it the end of the process, resets it, and the kernel forgets what it
/// holds.
void SetOptions(tcp::socket& socket) {
  const int fd = socket.native_handle();
  KeepWatch(fd);
  // Not as asio's option: asio takes that back in its destructors.
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  (void)setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
}

/// SIOCOUTQ: bytes that the peer has not acknowledged; SIOCOUTQNSD: those of them never sent.
std::uint64_t Queued(tcp::socket& socket, unsigned long which) {
  int count = 0;
  const bool known = ioctl(socket.native_handle(), which, &count) == 0 && count > 0;
  return known ? static_cast<std::uint64_t>(count) : 0;
}

class TcpClient final : public Transport {
 public:
  TcpClient(std::string port, const config::SerialSettings& serial, asio::io_context& io,
            TransportListener& listener, HostNames& names)
      : port_(std::move(port)),
        serial_(serial),
        io_(io),
        listener_(listener),
        names_(names),
        parity_(serial.software_parity ? serial.parity : config::Parity::none),
        ack_timer_(io) {}
  ~TcpClient() override { Close(); }

  void Open() override;
  void Close() override;
  bool is_open() const override { return session_ != nullptr; }
  void Send(View bytes) override;
  void DropUnsent() override;
  Status Apply(const config::SerialSettings& serial) override;
  Status Reset(const config::SerialSettings& serial) override;
  void Pause(bool paused) override {
    if (session_) session_->Pause(paused);
  }
  std::size_t Unsent() const override { return session_ ? session_->unsent() : 0; }
  /// The server has it, which may be slow to take it.
  bool IsDrained() const override {
    return !session_ || (session_->unsent() == 0 && Queued(session_->stream(), SIOCOUTQ) == 0);
  }
  Status PassOn() override {
    if (session_) session_->SetPatient(true);
    return {};
  }
  void Purge(bool /*input*/, bool output) override {
    if (session_ && output) session_->DropUnsent();
  }
  PortCounters Counters() const override { return {.parity = parity_.errors()}; }
  /// What a serial server is set to nobody here knows.
  std::string Describe() const override {
    return serial_.software_parity ? port_ + " " + serial_.ToString() : port_;
  }

 private:
  /// One Open under way. Its handlers keep it alive; without an owner they do nothing.
  struct Attempt {
    Attempt(asio::io_context& io, TcpClient* client) : owner(client), socket(io), deadline(io) {}
    TcpClient* owner;
    HostNames::Ticket look_up;
    bool looking_up = false;
    tcp::socket socket;
    asio::steady_timer deadline;
  };
  using AttemptPtr = std::shared_ptr<Attempt>;

  void Begin(const AttemptPtr& attempt);
  void Resolve(const AttemptPtr& attempt, const TcpAddress& address);
  void Connect(const AttemptPtr& attempt, const std::vector<tcp::endpoint>& endpoints);
  void OnConnected(const AttemptPtr& attempt);
  void Abandon();
  void Fail(const std::string& reason, NoConnection why = NoConnection::other);
  void OnRead(View raw);
  void OnEnd(const std::error_code& error);
  void GetStuck(const std::string& reason);
  std::uint64_t Acknowledged() const;
  void AwaitAcknowledgement();

  const std::string port_;
  config::SerialSettings serial_;
  asio::io_context& io_;
  TransportListener& listener_;
  HostNames& names_;
  AttemptPtr attempt_;
  std::shared_ptr<StreamPump<tcp::socket>> session_;
  SoftwareParity parity_;
  asio::steady_timer ack_timer_;
  std::shared_ptr<char> awaiting_;  ///< held while the timer runs; gone = its end means nothing
  Instant sent_at_{};               ///< the latest request
  std::uint64_t given_up_ = 0;      ///< so many bytes of the connection, from its first one
};

void TcpClient::Open() {
  Close();
  attempt_ = std::make_shared<Attempt>(io_, this);
  asio::post(io_, [attempt = attempt_] {
    if (attempt->owner != nullptr) attempt->owner->Begin(attempt);
  });
}

void TcpClient::Begin(const AttemptPtr& attempt) {
  const auto address = ParseTcpPort(port_);
  if (!address) return Fail(address.error());
  if (const Status possible = CheckSoftwareParity(serial_); !possible) {
    return Fail(possible.error());
  }
  attempt->deadline.expires_after(kConnectTimeout);
  attempt->deadline.async_wait([attempt](const std::error_code& error) {
    if (error || attempt->owner == nullptr) return;
    const std::string& port = attempt->owner->port_;
    if (attempt->looking_up) {
      return attempt->owner->Fail("no name server tells the address of " + port +
                                  "; is the name server reachable?");
    }
    attempt->owner->Fail(
        port + " does not answer; is the server on, its cable in, and its IP address right?",
        NoConnection::unreachable);
  });
  std::error_code not_numeric;
  const auto ip = asio::ip::make_address(address->host, not_numeric);
  if (not_numeric) {
    Resolve(attempt, *address);
  } else {
    Connect(attempt, {tcp::endpoint(ip, address->port)});
  }
}

void TcpClient::Resolve(const AttemptPtr& attempt, const TcpAddress& address) {
  attempt->looking_up = true;
  attempt->look_up = names_.Ask(
      address.host, io_, [attempt, port = address.port](const Result<HostNames::Addresses>& found) {
        if (attempt->owner == nullptr) return;
        attempt->looking_up = false;
        if (!found) {
          return attempt->owner->Fail("the host name of " + attempt->owner->port_ +
                                      " is not known (" + found.error() +
                                      "): correct it, or the DNS of this machine, or write the IP "
                                      "address");
        }
        std::vector<tcp::endpoint> endpoints;
        for (const asio::ip::address& ip : *found) endpoints.emplace_back(ip, port);
        attempt->owner->Connect(attempt, endpoints);
      });
}

void TcpClient::Connect(const AttemptPtr& attempt, const std::vector<tcp::endpoint>& endpoints) {
  asio::async_connect(
      attempt->socket, endpoints, [attempt](const std::error_code& error, const tcp::endpoint&) {
        if (attempt->owner == nullptr) return;
        if (!error) return attempt->owner->OnConnected(attempt);
        const bool away = error == asio::error::host_unreachable ||
                          error == asio::error::network_unreachable ||
                          error == asio::error::timed_out;
        const bool refused = error == asio::error::connection_refused;
        attempt->owner->Fail("cannot connect to " + attempt->owner->port_ + ": " + error.message() +
                                 (away ? "; is the host on, its cable in, and its IP address right?"
                                       : "; is the port number right, and its server (a serial "
                                         "server: in raw TCP mode) running and free?"),
                             away      ? NoConnection::unreachable
                             : refused ? NoConnection::refused
                                       : NoConnection::other);
      });
}

void TcpClient::OnConnected(const AttemptPtr& attempt) {
  SetOptions(attempt->socket);
  parity_ = SoftwareParity(serial_.software_parity ? serial_.parity : config::Parity::none);
  session_ = std::make_shared<StreamPump<tcp::socket>>(
      std::move(attempt->socket), [this](View raw) { OnRead(raw); },
      [this](const std::error_code& error) { OnEnd(error); }, [this] { listener_.OnRoom(); });
  Abandon();
  session_->Start();
  listener_.OnOpened();
}

void TcpClient::Abandon() {
  if (!attempt_) return;
  attempt_->owner = nullptr;
  attempt_->look_up = {};
  attempt_->deadline.cancel();
  std::error_code ignored;
  attempt_->socket.close(ignored);
  attempt_.reset();
}

void TcpClient::Fail(const std::string& reason, NoConnection why) {
  // It may live in the attempt that goes now.
  const std::string copy = reason;  // NOLINT(performance-unnecessary-copy-initialization)
  Abandon();
  listener_.OnNoConnection(copy, why);
}

void TcpClient::Close() {
  Abandon();
  awaiting_.reset();
  ack_timer_.cancel();
  if (!session_) return;
  session_->Stop();
  std::error_code ignored;
  session_->stream().close(ignored);
  session_.reset();
}

void TcpClient::Send(View bytes) {
  if (!session_) return;
  sent_at_ = std::chrono::steady_clock::now();
  session_->Send(serial_.software_parity ? View(parity_.Encode(bytes)) : bytes);
}

/// The kernel would repeat what has not arrived for seconds, and send what the peer had no room for
/// whenever there is room. It takes nothing back, so the connection has to go.
void TcpClient::DropUnsent() {
  if (!session_) return;
  session_->DropUnsent();
  given_up_ = session_->taken();
  if (!awaiting_ && Acknowledged() < given_up_) AwaitAcknowledgement();
}

std::uint64_t TcpClient::Acknowledged() const {
  return session_->taken() - Queued(session_->stream(), SIOCOUTQ);
}

void TcpClient::AwaitAcknowledgement() {
  awaiting_ = std::make_shared<char>();
  // What has not even been sent is not about to be acknowledged.
  const bool no_room = Queued(session_->stream(), SIOCOUTQNSD) > 0;
  ack_timer_.expires_at(no_room ? Instant{} : sent_at_ + kAckLimit);
  ack_timer_.async_wait([this, awaited = given_up_,
                         awaiting = std::weak_ptr(awaiting_)](const std::error_code& error) {
    if (error || awaiting.expired()) return;
    awaiting_.reset();
    if (Acknowledged() < awaited) {
      GetStuck(port_ + " takes no data: a request has not been acknowledged and is given up");
    } else if (Acknowledged() < given_up_) {
      AwaitAcknowledgement();
    }
  });
}

Status TcpClient::Apply(const config::SerialSettings& serial) {
  if (SameSettings(serial, serial_)) return {};
  return Error{"the serial settings behind " + port_ +
               " are set in the serial server; they cannot be switched to " + serial.ToString() +
               " from here"};
}

Status TcpClient::Reset(const config::SerialSettings& serial) {
  if (!session_) return {};
  session_->SetPatient(false);
  session_->Pause(false);
  DropUnsent();
  return Apply(serial);
}

void TcpClient::OnRead(View raw) {
  if (!serial_.software_parity) return listener_.OnBytes(raw);
  const Bytes characters = parity_.Decode(raw);
  listener_.OnBytes(characters);
}

void TcpClient::OnEnd(const std::error_code& error) {
  const bool full = error == asio::error::timed_out || error == asio::error::no_buffer_space;
  const bool reset = error == asio::error::connection_reset;
  if (error == asio::error::eof || reset) {
    const bool unread = reset || Queued(session_->stream(), SIOCOUTQ) > 0;
    Close();
    return listener_.OnEnded(port_ + (reset ? " reset" : " closed") + " the connection", unread);
  }
  if (full) return GetStuck(port_ + " takes no data or does not answer");
  Close();
  listener_.OnLost("the connection to " + port_ + " is lost: " + error.message());
}

void TcpClient::GetStuck(const std::string& reason) {
  Close();
  listener_.OnStuck(reason);
}

}  // namespace

std::unique_ptr<Transport> MakeTcpClient(std::string port, const config::SerialSettings& serial,
                                         asio::io_context& io, TransportListener& listener,
                                         HostNames& names) {
  return std::make_unique<TcpClient>(std::move(port), serial, io, listener, names);
}

}  // namespace baudgate
