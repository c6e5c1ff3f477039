// Benchmarks: Modbus reads per second, compared with a bare epoll server that answers with as many
// bytes; and the cost of TLS: reads per second with TLS, compared with those without, and the delay
// of a plain client while other clients make handshakes.
// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/ssl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "gateway/outputs/modbus/server/modbus_server.h"
#include "gateway/outputs/pki/server_files.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

constexpr int kPairs = 9;
constexpr auto kSlot = std::chrono::milliseconds(400);
constexpr double kWanted = 0.85;
constexpr std::size_t kRequest = 12;
constexpr int kPoints = 125;

int Listen(std::uint16_t& port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  bind(listener, reinterpret_cast<sockaddr*>(&address), length);
  listen(listener, 256);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  port = ntohs(address.sin_port);
  return listener;
}

void Watch(int poll, int descriptor) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  epoll_ctl(poll, EPOLL_CTL_ADD, descriptor, &event);
}

/// The limit to compare with: returns as many bytes as a Modbus reply has for each 12 bytes.
class EchoServer {
 public:
  explicit EchoServer(std::size_t reply) : reply_(reply), listener_(Listen(port_)) {
    thread_ = std::thread([this] { Run(); });
  }
  ~EchoServer() {
    stop_ = true;
    thread_.join();
    close(listener_);
  }
  std::uint16_t port() const { return port_; }

 private:
  void Run() {
    const int poll = epoll_create1(0);
    Watch(poll, listener_);
    std::array<epoll_event, 128> events{};
    std::array<std::uint8_t, 512> buffer{};
    while (!stop_) {
      const int count = epoll_wait(poll, events.data(), static_cast<int>(events.size()), 50);
      for (int i = 0; i < count; ++i) {
        const int descriptor = events[static_cast<std::size_t>(i)].data.fd;
        if (descriptor == listener_) {
          const int client = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK);
          const int on = 1;
          setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
          Watch(poll, client);
        } else if (read(descriptor, buffer.data(), buffer.size()) <= 0) {
          close(descriptor);
        } else if (send(descriptor, buffer.data(), reply_, MSG_NOSIGNAL) < 0) {
          close(descriptor);
        }
      }
    }
    close(poll);
  }

  std::size_t reply_;
  std::uint16_t port_ = 0;
  int listener_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// Connects to a port of this machine; ends the program if that fails.
int Connect(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  const int client = socket(AF_INET, SOCK_STREAM, 0);
  if (connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    fmt::print(stderr, "connect: {}\n", strerror(errno));
    std::exit(4);
  }
  const int on = 1;
  setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return client;
}

/// Makes a TLS connection over `client`; null: the handshake failed.
SSL* Secure(SSL_CTX* context, int client) {
  SSL* const ssl = SSL_new(context);
  SSL_set_fd(ssl, client);
  if (SSL_connect(ssl) == 1) return ssl;
  SSL_free(ssl);
  return nullptr;
}

class Clients {
 public:
  /// `tls` null: the connections are not encrypted.
  Clients(std::uint16_t port, int connections, std::uint8_t registers, SSL_CTX* tls = nullptr)
      : poll_(epoll_create1(0)) {
    request_ = {0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0, registers};
    reply_ = 9 + 2U * registers;
    for (int i = 0; i < connections; ++i) {
      const int client = Connect(port);
      if (tls != nullptr) secured_[client] = Secure(tls, client);
      Watch(poll_, client);
      clients_.push_back(client);
    }
  }
  ~Clients() {
    for (const auto& [client, ssl] : secured_) SSL_free(ssl);
    for (const int client : clients_) close(client);
    close(poll_);
  }

  double Run() {
    for (const int client : clients_) Ask(client);
    const auto began = std::chrono::steady_clock::now();
    const auto until = began + kSlot;
    std::uint64_t replies = 0;
    std::size_t outstanding = clients_.size();
    std::array<epoll_event, 128> events{};
    std::array<std::uint8_t, 512> buffer{};
    while (outstanding > 0) {
      const int count = epoll_wait(poll_, events.data(), static_cast<int>(events.size()), 1000);
      const bool over = std::chrono::steady_clock::now() >= until;
      for (int i = 0; i < count; ++i) {
        const int client = events[static_cast<std::size_t>(i)].data.fd;
        const ssize_t got = secured_.empty() ? recv(client, buffer.data(), reply_, MSG_WAITALL)
                                             : SSL_read(secured_[client], buffer.data(),
                                                        static_cast<int>(buffer.size()));
        if (got != static_cast<ssize_t>(reply_)) {
          fmt::print(stderr, "a reply of {} bytes in place of {}\n", got, reply_);
          std::exit(1);
        }
        ++replies;
        if (over) {
          --outstanding;
        } else {
          Ask(client);
        }
      }
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    return static_cast<double>(replies) / took.count();
  }

 private:
  void Ask(int client) {
    if (secured_.empty()) {
      send(client, request_.data(), request_.size(), MSG_NOSIGNAL);
    } else {
      SSL_write(secured_[client], request_.data(), static_cast<int>(request_.size()));
    }
  }

  int poll_;
  std::vector<int> clients_;
  std::map<int, SSL*> secured_;
  std::array<std::uint8_t, kRequest> request_{};
  std::size_t reply_ = 0;
};

class NoCommands final : public bus::CommandSink {
 public:
  bool Submit(bus::WriteCommand) override { return false; }
};

config::Config MakeConfig() {
  config::Config config;
  config::Listener listener;
  listener.port = 0;
  config.modbus.listen.push_back(listener);
  config::Line line;
  line.name = "line";
  config::Device device;
  device.name = "device";
  device.unit = 1;
  device.poll = 1h;
  for (int i = 0; i < kPoints; ++i) {
    config::Point point;
    point.name = fmt::format("p{}", i);
    point.type = config::Type::uint16;
    point.modbus = static_cast<std::uint16_t>(i);
    device.points.push_back(point);
  }
  line.devices.push_back(device);
  config.lines.push_back(line);
  return config;
}

class Server {
 public:
  explicit Server(config::Config config = MakeConfig())
      : config_(std::move(config)),
        store_(config_),
        server_(config_, store_, sink_, [] { return modbus::GatewayFigures{}; }) {
    std::vector<bus::Sample> samples;
    for (std::uint32_t i = 0; i < kPoints; ++i)
      samples.push_back({i, std::int64_t{i}, Quality::good});
    store_.Update(0, samples, ReadClocks(), 1ms);
    if (const Status status = server_.Listen(io_); !status) {
      fmt::print(stderr, "{}\n", status.error());
      std::exit(4);
    }
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Server() {
    asio::post(io_, [this] {
      server_.Stop();
      io_.stop();
    });
    thread_.join();
  }
  std::uint16_t port(std::size_t listener = 0) const { return server_.port(listener); }

 private:
  config::Config config_;
  bus::PointStore store_;
  NoCommands sink_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
  modbus::ModbusServer server_;
  std::thread thread_;
};

void RunOne(const Server& server, std::uint8_t registers, int connections) {
  const EchoServer echo(9 + 2U * registers);
  Clients ours(server.port(), connections, registers);
  Clients limit(echo.port(), connections, registers);
  ours.Run();
  limit.Run();
  std::vector<double> ratios;
  std::vector<double> rates;
  for (int pair = 0; pair < kPairs; ++pair) {
    const double first = limit.Run();
    const double rate = ours.Run();
    rates.push_back(rate);
    ratios.push_back(rate / first);
  }
  const double ratio = Median(ratios);
  fmt::print(
      "  {:>3} registers, {:>3} connections: {:>7.0f}/s, {:.2f} of the echo ({:.2f} to {:.2f})  "
      "{}\n",
      registers, connections, Median(rates), ratio, Percentile(ratios, 0), Percentile(ratios, 1),
      Verdict(ratio >= kWanted));
}

/// Returns the 99th percentile of the times of one client's reads during about two seconds, in ms.
double WorstDelay(std::uint16_t port) {
  constexpr std::array<std::uint8_t, kRequest> kAsk = {0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0, 10};
  const int client = Connect(port);
  std::vector<double> delays;
  std::array<std::uint8_t, 29> reply{};
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  while (std::chrono::steady_clock::now() < until) {
    const auto began = std::chrono::steady_clock::now();
    send(client, kAsk.data(), kAsk.size(), MSG_NOSIGNAL);
    recv(client, reply.data(), reply.size(), MSG_WAITALL);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    delays.push_back(took.count());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  close(client);
  return Percentile(delays, 0.99);
}

}  // namespace

void RunTls() {
  constexpr int kConnections = 100;
  constexpr double kWantedShare = 0.8;
  constexpr double kWantedDelay = 2;  // ms
  constexpr auto kBetweenHandshakes = std::chrono::milliseconds(2);
  const std::string folder = Scratch() + "/tls";
  const auto made =
      pki::WriteServerFiles(folder, {"localhost"}, {{"viewer", "viewer"}}, ReadClocks().wall);
  if (!made) {
    fmt::print(stderr, "{}\n", made.error());
    std::exit(4);
  }
  config::Config config = MakeConfig();
  config::Listener secure = config.modbus.listen.front();
  secure.protocol = config::Listener::Protocol::tls;
  secure.tls = {folder + "/gateway.pem", folder + "/gateway.key", folder + "/ca.pem"};
  secure.roles = {{.role = "viewer", .permit = config::Permit::read}};
  config.modbus.listen.push_back(secure);
  const Server server(std::move(config));
  SSL_CTX* const context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_read_ahead(context, 1);
  SSL_CTX_use_certificate_chain_file(context, (folder + "/viewer.pem").c_str());
  SSL_CTX_use_PrivateKey_file(context, (folder + "/viewer.key").c_str(), SSL_FILETYPE_PEM);

  fmt::print("tls (wanted: {:.2f} of the reads without TLS, median of {} interleaved pairs)\n",
             kWantedShare, kPairs);
  for (const std::uint8_t registers : {std::uint8_t{10}, std::uint8_t{125}}) {
    Clients plain(server.port(0), kConnections, registers);
    Clients encrypted(server.port(1), kConnections, registers, context);
    plain.Run();
    encrypted.Run();
    std::vector<double> ratios;
    std::vector<double> rates;
    for (int pair = 0; pair < kPairs; ++pair) {
      const double limit = plain.Run();
      rates.push_back(encrypted.Run());
      ratios.push_back(rates.back() / limit);
    }
    fmt::print("  {:>3} registers, {} clients: {:>7.0f}/s, {:.2f} of plain reads  {}\n", registers,
               kConnections, Median(rates), Median(ratios),
               Verdict(Median(ratios) >= kWantedShare));
  }

  const double quiet = WorstDelay(server.port(0));
  std::atomic<bool> stop = false;
  std::atomic<int> handshakes = 0;
  std::thread flood([&] {
    auto next = std::chrono::steady_clock::now();
    while (!stop) {
      const int client = Connect(server.port(1));
      if (SSL* const ssl = Secure(context, client)) {
        ++handshakes;
        SSL_free(ssl);
      }
      close(client);
      next += kBetweenHandshakes;
      std::this_thread::sleep_until(next);
    }
  });
  const double busy = WorstDelay(server.port(0));
  stop = true;
  flood.join();
  SSL_CTX_free(context);
  fmt::print("  plain reads beside {} handshakes a second: p99 {:.2f} ms, without {:.2f} ms  {}\n",
             handshakes / 2, busy, quiet, Verdict(busy - quiet < kWantedDelay));
}

void RunModbusRate() {
  fmt::print("modbus reads (wanted: {:.2f} of a bare epoll echo, median of {} interleaved pairs)\n",
             kWanted, kPairs);
  const Server server;
  for (const std::uint8_t registers : {std::uint8_t{10}, std::uint8_t{125}}) {
    for (const int connections : {1, 10, 100}) RunOne(server, registers, connections);
  }
}

}  // namespace baudgate::bench
