// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/simulator.h"

#include <algorithm>
#include <asio/ip/tcp.hpp>

#include "gateway/tools/simulate/pty.h"
#include "gateway/tools/simulate/twin_port.h"
#include "transports/serial_settings.h"

namespace baudgate::tools {
namespace {

/// The limit of connections. If it is exceeded, the oldest connection is closed.
constexpr std::size_t kMostConnections = 16;

std::shared_ptr<TwinBus> MakeBusOf(std::vector<TwinGroup> groups, const SimulatorOptions& options) {
  auto bus = std::make_shared<TwinBus>();
  if (!groups.empty()) bus->wire.serial = groups.front().protocol->serial;
  if (options.pace) bus->wire.serial = *options.pace;
  bus->wire.paced = options.pace.has_value();
  bus->wire.think = options.think_time;
  bus->strict = options.strict && !options.listen;
  bus->observer = options.observer;
  for (TwinGroup& group : groups) {
    TwinWire wire = bus->wire;
    if (!options.pace) wire.serial = group.protocol->serial;
    bus->residents.push_back(std::make_unique<Residents>(*group.protocol, std::move(group.devices),
                                                         wire, options.events));
  }
  return bus;
}

}  // namespace

struct Simulator::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::io_context& its_io, std::shared_ptr<TwinBus> its_bus)
      : io(its_io), bus(std::move(its_bus)), acceptor(its_io) {}

  Status OpenPty(const SimulatorOptions& options);
  Status Listen(const config::HostPort& at);
  void Accept();
  void AddPort(int descriptor);

  asio::io_context& io;
  std::shared_ptr<TwinBus> bus;
  std::optional<Pty> pty;
  asio::ip::tcp::acceptor acceptor;
  std::string path;
  std::vector<std::shared_ptr<TwinPort>> ports;
};

Status Simulator::Impl::OpenPty(const SimulatorOptions& options) {
  auto made = Pty::Create(options.link);
  if (!made) return Error{made.error()};
  pty.emplace(std::move(*made));
  path = pty->path();
  if (bus->strict) {
    const Status set = transports::SetPtyFormat(pty->master(), bus->wire.serial);
    if (!set) return Error{"cannot set " + path + ": " + set.error()};
  }
  AddPort(pty->TakeMaster());
  return {};
}

Status Simulator::Impl::Listen(const config::HostPort& at) {
  asio::error_code error;
  const auto address = asio::ip::make_address(at.host, error);
  const asio::ip::tcp::endpoint endpoint(address, at.port);
  if (!error) acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    return Error{"cannot listen at " + at.host + ":" + std::to_string(at.port) + ": " +
                 error.message()};
  }
  const auto bound = acceptor.local_endpoint(error);
  const bool bracketed = at.host.find(':') != std::string::npos;
  path = "tcp://" + (bracketed ? "[" + at.host + "]" : at.host) + ":" +
         std::to_string(error ? at.port : bound.port());
  Accept();
  return {};
}

void Simulator::Impl::Accept() {
  acceptor.async_accept(
      [weak = weak_from_this()](const asio::error_code& error, asio::ip::tcp::socket socket) {
        const auto self = weak.lock();
        if (!self || error == asio::error::operation_aborted) return;
        asio::error_code failed;
        socket.set_option(asio::ip::tcp::no_delay(true), failed);
        const int descriptor = error ? -1 : socket.release(failed);
        if (descriptor >= 0 && !failed) self->AddPort(descriptor);
        self->Accept();
      });
}

void Simulator::Impl::AddPort(int descriptor) {
  std::erase_if(ports, [](const auto& port) { return port->is_over(); });
  if (ports.size() >= kMostConnections) {
    ports.front()->Close();
    ports.erase(ports.begin());
  }
  ports.push_back(std::make_shared<TwinPort>(io, descriptor, bus));
  ports.back()->Start();
}

Result<std::unique_ptr<Simulator>> Simulator::Create(asio::io_context& io,
                                                     std::vector<TwinGroup> groups,
                                                     const SimulatorOptions& options) {
  auto impl = std::make_shared<Impl>(io, MakeBusOf(std::move(groups), options));
  std::unique_ptr<Simulator> simulator(new Simulator(impl));
  simulator->SetFaults(options.faults);
  const Status opened = options.listen ? impl->Listen(*options.listen) : impl->OpenPty(options);
  if (!opened) return Error{opened.error()};
  return simulator;
}

Result<std::unique_ptr<Simulator>> Simulator::Create(asio::io_context& io,
                                                     const protocols::Protocol& protocol,
                                                     std::vector<config::Device> devices,
                                                     const SimulatorOptions& options) {
  std::vector<TwinGroup> groups;
  groups.push_back({&protocol, std::move(devices)});
  return Create(io, std::move(groups), options);
}

Simulator::Simulator(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulator::~Simulator() = default;
const std::string& Simulator::path() const { return impl_->path; }
std::uint64_t Simulator::answered() const { return impl_->bus->answered; }
std::uint64_t Simulator::characters() const { return impl_->bus->characters; }

std::vector<FaultCount> Simulator::fault_counts() const {
  std::vector<FaultCount> all;
  for (const auto& residents : impl_->bus->residents) {
    for (FaultCount& count : residents->fault_counts()) all.push_back(std::move(count));
  }
  return all;
}

std::pair<std::uint64_t, std::uint64_t> Simulator::event_counts() const {
  std::pair<std::uint64_t, std::uint64_t> counts;
  for (const auto& residents : impl_->bus->residents) {
    const auto [raised, refused] = residents->event_counts();
    counts.first += raised;
    counts.second += refused;
  }
  return counts;
}

void Simulator::SetFaults(const std::vector<Fault>& faults) {
  for (const auto& residents : impl_->bus->residents) {
    residents->SetFaults(faults, std::chrono::steady_clock::now());
  }
}

namespace {

/// True if requests to devices with the options `a` and with the options `b` are divided by the
/// same frame rule. Example: false for two DCON modules of which one has its checksum on. If the
/// options are equal, the rules are not compared, because descriptions of telegrams make a new
/// frame rule at each parse.
bool AreCutAlike(const protocols::Protocol& protocol, const config::Options& a,
                 const config::Options& b) {
  return a == b || protocol.expect({}, ParseOptions(protocol, a)) ==
                       protocol.expect({}, ParseOptions(protocol, b));
}

}  // namespace

Result<std::unique_ptr<Simulator>> SimulateLine(asio::io_context& io, const config::Line& line,
                                                const config::Catalog& catalog,
                                                SimulatorOptions options) {
  std::vector<TwinGroup> groups;
  for (const config::Device& device : line.devices) {
    const protocols::Protocol* protocol = catalog.FindProtocol(device.protocol);
    if (protocol == nullptr) return Error{"protocol " + device.protocol + " is not installed"};
    // A group receives only requests that fit the options of its first device, so devices with
    // other options need a separate group.
    const auto same = std::ranges::find_if(groups, [&](const TwinGroup& group) {
      return group.protocol == protocol &&
             AreCutAlike(*protocol, group.devices.front().options, device.options);
    });
    TwinGroup& group = same != groups.end() ? *same : groups.emplace_back(TwinGroup{protocol, {}});
    group.devices.push_back(device);
  }
  if (!line.tcp) options.pace = line.serial;
  options.strict = true;
  return Simulator::Create(io, std::move(groups), options);
}

}  // namespace baudgate::tools
