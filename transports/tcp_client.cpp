// `TcpClient` looks up the host, connects within a deadline, then transfers bytes.
// SPDX-License-Identifier: Apache-2.0
#include "transports/tcp_client.h"

#include <linux/sockios.h>
#include <netdb.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <asio/connect.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>

#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"
#include "transports/listen_socket.h"
#include "transports/net_stream.h"
#include "transports/parity.h"
#include "transports/serial_settings.h"
#include "transports/stream_pump.h"
#include "transports/tls_handshakes.h"

namespace baudgate::transports {

Result<TcpAddress> ParseTcpPort(std::string_view port) {
  const auto wrong = [port](const char* why) {
    return Error{"\"" + std::string(port) + "\" is not a serial server address: " + why +
                 "; write tcp://host:port or tcp://[::1]:port"};
  };
  if (!config::IsNetworkPort(port)) return wrong("it does not start with tcp:// or tls://");
  std::string_view rest = port.substr(config::kTcpScheme.size());
  std::string_view host;
  if (rest.starts_with('[')) {
    const auto end = rest.find(']');
    if (end == std::string_view::npos) return wrong("the bracket is not closed");
    host = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
    if (host.find(':') == std::string_view::npos) return wrong("brackets are for IPv6 addresses");
  } else {
    const auto colon = rest.find(':');
    host = rest.substr(0, colon);
    rest.remove_prefix(host.size());
    if (rest.find(':', 1) != std::string_view::npos) {
      return wrong("an IPv6 address needs brackets");
    }
  }
  if (host.empty()) return wrong("the host is missing");
  if (host.find_first_of("/@?# \t[]") != std::string_view::npos) {
    return wrong("the host contains a character that is not allowed");
  }
  if (!rest.starts_with(':')) return wrong("the port number is missing");
  const auto number = ParseInteger<std::uint16_t>(rest.substr(1));
  if (!number || *number == 0) return wrong("the port number is not 1…65535");
  return TcpAddress{std::string(host), *number};
}

// Hosts wait in one queue for a thread. Each thread makes one look-up.

namespace {

Result<HostNames::Addresses> AskSystem(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failed != 0) return Error{failed == EAI_SYSTEM ? std::strerror(errno) : gai_strerror(failed)};
  HostNames::Addresses addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    asio::ip::tcp::endpoint endpoint;
    if (one->ai_addrlen > endpoint.capacity()) continue;
    std::memcpy(endpoint.data(), one->ai_addr, one->ai_addrlen);
    addresses.push_back(endpoint.address());
  }
  freeaddrinfo(found);
  return addresses;
}

}  // namespace

struct HostNames::Waiter {
  Waiter(asio::io_context& its_io, Done its_done) : io(&its_io), done(std::move(its_done)) {}
  Mutex mutex;
  asio::io_context* io BAUDGATE_GUARDED_BY(mutex);  // null: the caller does not wait any more
  Done done BAUDGATE_GUARDED_BY(mutex);
};

struct HostNames::State {
  struct Host {
    std::vector<std::shared_ptr<Waiter>> waiters;
    bool running = false;
    // True: all callers gave up during a look-up, and no awaited look-up has succeeded since.
    bool given_up = false;
  };

  explicit State(LookUp its_look_up) : look_up(std::move(its_look_up)) {}

  bool MayBegin(const Host& host) const BAUDGATE_REQUIRES(mutex) {
    if (threads >= kMostAwaited + kMostHanging) return false;
    return host.given_up ? hanging < kMostRetried : threads - hanging < kMostAwaited;
  }

  const LookUp look_up;
  Mutex mutex;
  std::map<std::string, Host> hosts BAUDGATE_GUARDED_BY(mutex);
  std::deque<std::string> queue BAUDGATE_GUARDED_BY(mutex);
  std::size_t threads BAUDGATE_GUARDED_BY(mutex) = 0;
  // The number of threads that look up hosts whose `given_up` is true.
  std::size_t hanging BAUDGATE_GUARDED_BY(mutex) = 0;

  static void Begin(const std::shared_ptr<State>& state) BAUDGATE_REQUIRES(state->mutex);
  static void Run(const std::shared_ptr<State>& state, const std::string& name);
  static void Drop(const std::shared_ptr<State>& state, const std::string& name,
                   const std::shared_ptr<Waiter>& waiter);
  static void Answer(const std::shared_ptr<Waiter>& waiter, const Result<Addresses>& found);
};

/// Starts threads for the hosts that may be looked up now.
void HostNames::State::Begin(const std::shared_ptr<State>& state) {
  for (auto at = state->queue.begin(); at != state->queue.end();) {
    Host& host = state->hosts[*at];
    if (!state->MayBegin(host)) {
      ++at;
      continue;
    }
    // If no thread can be started, the next Ask or the next end of a look-up tries again.
    if (!StartDetached("host names", [state, name = *at] { Run(state, name); })) return;
    ++state->threads;
    if (host.given_up) ++state->hanging;
    host.running = true;
    at = state->queue.erase(at);
  }
}

void HostNames::State::Run(const std::shared_ptr<State>& state, const std::string& name) {
  const Result<Addresses> found = state->look_up(name);
  std::vector<std::shared_ptr<Waiter>> waiters;
  {
    const MutexLock lock(state->mutex);
    Host& host = state->hosts[name];
    if (host.given_up) --state->hanging;
    --state->threads;
    host.running = false;
    waiters.swap(host.waiters);
    if (found && !waiters.empty()) host.given_up = false;
    Begin(state);
  }
  for (const auto& waiter : waiters) Answer(waiter, found);
}

void HostNames::State::Answer(const std::shared_ptr<Waiter>& waiter,
                              const Result<Addresses>& found) {
  const MutexLock lock(waiter->mutex);
  if (waiter->io == nullptr) return;
  asio::post(*waiter->io, [waiter, found] {
    Done done;
    {
      const MutexLock again(waiter->mutex);
      if (std::exchange(waiter->io, nullptr) == nullptr) return;
      done = std::move(waiter->done);
    }
    done(found);
  });
}

void HostNames::State::Drop(const std::shared_ptr<State>& state, const std::string& name,
                            const std::shared_ptr<Waiter>& waiter) {
  Done dropped;  // destroyed outside the locks, because it may own a ticket, whose Drop locks again
  {
    const MutexLock lock(waiter->mutex);
    waiter->io = nullptr;
    dropped.swap(waiter->done);
  }
  const MutexLock lock(state->mutex);
  Host& host = state->hosts[name];
  if (std::erase(host.waiters, waiter) == 0 || !host.waiters.empty()) return;
  if (!host.running) {
    std::erase(state->queue, name);
  } else if (!std::exchange(host.given_up, true)) {
    ++state->hanging;
    Begin(state);
  }
}

HostNames::Ticket& HostNames::Ticket::operator=(Ticket&& other) noexcept {
  if (this != &other) {
    Drop();
    drop_ = std::exchange(other.drop_, nullptr);
  }
  return *this;
}

void HostNames::Ticket::Drop() {
  if (const auto drop = std::exchange(drop_, nullptr)) drop();
}

HostNames::HostNames(LookUp look_up) : state_(std::make_shared<State>(std::move(look_up))) {}

HostNames::Ticket HostNames::Ask(const std::string& host, asio::io_context& io, Done done) {
  auto waiter = std::make_shared<Waiter>(io, std::move(done));
  Ticket ticket;
  ticket.drop_ = [state = state_, host, waiter] { State::Drop(state, host, waiter); };
  const MutexLock lock(state_->mutex);
  State::Host& asked = state_->hosts[host];
  asked.waiters.push_back(std::move(waiter));
  if (!asked.running && asked.waiters.size() == 1) state_->queue.push_back(host);
  State::Begin(state_);
  return ticket;
}

HostNames& HostNames::OfProcess() {
  static HostNames names(AskSystem);
  return names;
}

namespace {

using asio::ip::tcp;

constexpr std::chrono::seconds kConnectTimeout{5};  // for name look-up and connection together
/// A healthy peer acknowledges within this time (RFC 1122, 4.2.3.2); some small serial servers take
/// 250 ms. The time counts from Send, because a request can be given up sooner.
constexpr Duration kAckLimit = 500ms;

/// Sets options so that a vanished peer is noticed, and a closed connection sends nothing more:
/// every close, even by the end of the process, resets the connection, so that the kernel drops its
/// buffer.
void SetOptions(tcp::socket& socket) {
  const int fd = socket.native_handle();
  KeepWatch(fd);
  // SO_LINGER is set directly, because asio's destructors would undo asio's own linger option.
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  (void)setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
}

/// Returns a byte count of the send queue. SIOCOUTQ: bytes that the peer has not acknowledged;
/// SIOCOUTQNSD: bytes that were never sent.
std::uint64_t Queued(tls::NetStream& socket, unsigned long which) {
  int count = 0;
  const bool known = ioctl(socket.native_handle(), which, &count) == 0 && count > 0;
  return known ? static_cast<std::uint64_t>(count) : 0;
}

class TcpClient final : public Transport {
 public:
  TcpClient(std::string port, const config::SerialSettings& serial, const config::TlsFiles& tls,
            asio::io_context& io, TransportListener& listener, HostNames& names)
      : port_(std::move(port)),
        tls_(std::make_shared<tls::ContextFiles>(tls::End::client, tls)),
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
  /// True if the server has acknowledged all bytes. They may still wait for its serial port.
  bool IsDrained() const override {
    return !session_ || (session_->unsent() == 0 && Queued(session_->stream(), SIOCOUTQ) == 0);
  }
  Status PassOn() override {
    if (session_) session_->SetPatient(true);
    return {};
  }
  void Purge(bool /*input*/, bool output) override {
    if (session_ && output) Withdraw();
  }
  PortCounters Counters() const override { return {.parity = parity_.errors()}; }
  /// Omits the serial settings unless software parity is used: the server has its own settings.
  std::string Describe() const override {
    return serial_.software_parity ? port_ + " " + serial_.ToString() : port_;
  }

 private:
  /// A running Open. Its handlers keep it alive; they do nothing once `owner` is null.
  struct Attempt {
    Attempt(asio::io_context& io, TcpClient* client) : owner(client), socket(io), deadline(io) {}
    TcpClient* owner;
    HostNames::Ticket look_up;
    bool looking_up = false;
    bool is_connected = false;
    std::string host;
    tls::Handshakes::Ticket handshake;
    tcp::socket socket;
    asio::steady_timer deadline;
  };
  using AttemptPtr = std::shared_ptr<Attempt>;

  void Begin(const AttemptPtr& attempt);
  void Resolve(const AttemptPtr& attempt, const TcpAddress& address);
  void Connect(const AttemptPtr& attempt, const std::vector<tcp::endpoint>& endpoints);
  void OnConnected(const AttemptPtr& attempt);
  void BeginTls(const AttemptPtr& attempt);
  void BeginSession(tls::NetStream stream);
  void Abandon();
  void Fail(const std::string& reason, NoConnection why = NoConnection::other);
  void OnRead(View raw);
  void OnStreamEnd(const std::error_code& error);
  void GetStuck(const std::string& reason);
  void Withdraw();
  std::uint64_t Acknowledged() const;
  void AwaitAcknowledgement();

  const std::string port_;
  const std::shared_ptr<tls::ContextFiles> tls_;
  config::SerialSettings serial_;
  asio::io_context& io_;
  TransportListener& listener_;
  HostNames& names_;
  AttemptPtr attempt_;
  std::shared_ptr<StreamPump<tls::NetStream>> session_;
  SoftwareParity parity_;
  asio::steady_timer ack_timer_;
  std::shared_ptr<char> awaiting_;  ///< null: no wait is planned, so ack_timer_ has no effect
  Instant sent_at_{};
  /// Requests up to this position of the connection's output were given up.
  std::uint64_t given_up_ = 0;
  bool is_cut_ = false;  ///< true: the connection ends, and nothing more is sent
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
  attempt->host = address->host;
  attempt->deadline.expires_after(kConnectTimeout);
  attempt->deadline.async_wait([attempt](const std::error_code& error) {
    if (error || attempt->owner == nullptr) return;
    const std::string& port = attempt->owner->port_;
    if (attempt->looking_up) {
      return attempt->owner->Fail("no name server answers the query for the host of " + port +
                                  "; check the name server and the way to it");
    }
    if (attempt->is_connected) {
      return attempt->owner->Fail(port +
                                  " accepts the connection, but does not answer the TLS handshake; "
                                  "check that this port of the server speaks TLS");
    }
    attempt->owner->Fail(port +
                             " does not answer; check that the server is on, its cable is plugged "
                             "in, and its IP address is right",
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
          return attempt->owner->Fail(
              "the host name of " + attempt->owner->port_ + " is not known (" + found.error() +
              "); correct the name or the DNS of this machine, or write the IP address in port");
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
        attempt->owner->Fail(
            "cannot connect to " + attempt->owner->port_ + ": " + error.message() +
                (away ? "; check that the server is on, its cable is plugged in, and its IP "
                        "address is right"
                      : "; check that the port number is right, and that the server is running, "
                        "free, and in raw TCP mode if it is a serial server"),
            away      ? NoConnection::unreachable
            : refused ? NoConnection::refused
                      : NoConnection::other);
      });
}

void TcpClient::OnConnected(const AttemptPtr& attempt) {
  SetOptions(attempt->socket);
  if (config::IsTlsAddress(port_)) return BeginTls(attempt);
  BeginSession(tls::NetStream(std::move(attempt->socket)));
}

void TcpClient::BeginTls(const AttemptPtr& attempt) {
  std::error_code failed;
  const int owned = attempt->socket.release(failed);
  attempt->is_connected = true;
  attempt->handshake = tls::Handshakes::OfProcess().Begin(
      owned, tls_, attempt->host, io_, [attempt](Result<std::unique_ptr<tls::Channel>> result) {
        TcpClient* const owner = attempt->owner;
        if (owner == nullptr) return;
        if (!result)
          return owner->Fail("cannot connect to " + owner->port_ + ": " + result.error());
        tcp::socket socket = tls::SocketOf(**result, owner->io_);
        owner->BeginSession(tls::NetStream(std::move(socket), std::move(*result)));
      });
}

void TcpClient::BeginSession(tls::NetStream stream) {
  parity_ = SoftwareParity(serial_.software_parity ? serial_.parity : config::Parity::none);
  is_cut_ = false;
  session_ = std::make_shared<StreamPump<tls::NetStream>>(
      std::move(stream), [this](View raw) { OnRead(raw); },
      [this](const std::error_code& error) { OnStreamEnd(error); }, [this] { listener_.OnRoom(); });
  Abandon();
  session_->Start();
  listener_.OnOpened();
}

void TcpClient::Abandon() {
  if (!attempt_) return;
  attempt_->owner = nullptr;
  attempt_->look_up = {};
  attempt_->handshake = {};
  attempt_->deadline.cancel();
  std::error_code ignored;
  attempt_->socket.close(ignored);
  attempt_.reset();
}

void TcpClient::Fail(const std::string& reason, NoConnection why) {
  // `reason` may be part of the attempt, which is destroyed here.
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
  if (!session_ || is_cut_) return;
  sent_at_ = std::chrono::steady_clock::now();
  session_->Send(serial_.software_parity ? View(parity_.Encode(bytes)) : bytes);
}

/// The kernel cannot withdraw bytes: it retransmits them for seconds, and sends them as soon as the
/// peer has room. So the connection is closed unless the peer acknowledges them in time.
void TcpClient::DropUnsent() {
  if (!session_) return;
  Withdraw();
  given_up_ = session_->taken();
  if (!awaiting_ && Acknowledged() < given_up_) AwaitAcknowledgement();
}

/// Discards the bytes that the system has not accepted. With TLS they can be part of a record whose
/// beginning is sent, and OpenSSL would send the rest in place of the next request: the connection
/// ends.
void TcpClient::Withdraw() {
  if (!session_->DropUnsent() || session_->stream().channel() == nullptr) return;
  is_cut_ = true;
  session_->EndSoon(asio::error::no_buffer_space);
}

std::uint64_t TcpClient::Acknowledged() const {
  // With TLS, the queue has more bytes than were taken.
  return session_->taken() - std::min(session_->taken(), Queued(session_->stream(), SIOCOUTQ));
}

void TcpClient::AwaitAcknowledgement() {
  awaiting_ = std::make_shared<char>();
  // If some bytes are still unsent, the peer has no room and will not acknowledge soon.
  const bool no_room = Queued(session_->stream(), SIOCOUTQNSD) > 0;
  ack_timer_.expires_at(no_room ? Instant{} : sent_at_ + kAckLimit);
  ack_timer_.async_wait([this, awaited = given_up_,
                         awaiting = std::weak_ptr(awaiting_)](const std::error_code& error) {
    if (error || awaiting.expired()) return;
    awaiting_.reset();
    if (Acknowledged() < awaited) {
      GetStuck(port_ +
               " takes no data, so the gateway gives up a request that was not acknowledged");
    } else if (Acknowledged() < given_up_) {
      AwaitAcknowledgement();
    }
  });
}

Status TcpClient::Apply(const config::SerialSettings& serial) {
  if (SameSettings(serial, serial_)) return {};
  return Error{"the serial settings behind " + port_ +
               " are set in the serial server, so the gateway cannot change them to " +
               serial.ToString() + "; set them there"};
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

void TcpClient::OnStreamEnd(const std::error_code& error) {
  const bool full = error == asio::error::timed_out || error == asio::error::no_buffer_space;
  const bool reset = error == asio::error::connection_reset;
  if (error == asio::error::eof || reset) {
    const bool unread = reset || Queued(session_->stream(), SIOCOUTQ) > 0;
    Close();
    return listener_.OnEnded(port_ + (reset ? " reset" : " closed") + " the connection", unread);
  }
  if (full)
    return GetStuck(port_ +
                    " takes no data or does not answer; check this server and the network to it");
  Close();
  listener_.OnLost("the connection to " + port_ + " is lost: " + error.message());
}

void TcpClient::GetStuck(const std::string& reason) {
  Close();
  listener_.OnStuck(reason);
}

}  // namespace

std::unique_ptr<Transport> MakeTcpClient(std::string port, const config::SerialSettings& serial,
                                         const config::TlsFiles& tls, asio::io_context& io,
                                         TransportListener& listener, HostNames& names) {
  return std::make_unique<TcpClient>(std::move(port), serial, tls, io, listener, names);
}

}  // namespace baudgate::transports
