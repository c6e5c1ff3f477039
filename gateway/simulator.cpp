// SPDX-License-Identifier: Apache-2.0
#include "gateway/simulator.h"

#include <algorithm>
#include <array>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <cmath>
#include <numbers>
#include <utility>

#include "gateway/assembler.h"
#include "transports/pty.h"

namespace baudgate {
namespace {

constexpr double kWaveSeconds = 60;
/// A paced reply is handed over in pieces of about so long, as a UART's FIFO does.
constexpr Duration kPiece = 2ms;

}  // namespace

SimulatedValues::SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed)
    : points_(points), seed_(seed), written_(points.size()) {}

Value SimulatedValues::Get(std::size_t index, Instant now) const {
  if (HasValue(written_[index])) return written_[index];
  const config::Point& point = points_[index];
  const config::Simulate simulate = point.simulate.value_or(config::Simulate{});
  if (point.type == config::Type::string) return simulate.text.value_or(std::string());
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  const double phase = 0.7 * static_cast<double>(index) + 2.1 * static_cast<double>(seed_);
  const double wave = std::sin(2 * std::numbers::pi * seconds / kWaveSeconds + phase);
  const double value = simulate.low + (simulate.high - simulate.low) * (0.5 + 0.5 * wave);
  switch (point.type) {
    case config::Type::boolean:
      return value >= 0.5;
    case config::Type::float32:
    case config::Type::float64:
      return value;
    default:
      return static_cast<std::int64_t>(std::llround(value));
  }
}

void SimulatedValues::Set(std::size_t point, const Value& value) { written_[point] = value; }

struct Simulator::Impl {
  struct Inhabitant {
    config::Device device;
    std::unique_ptr<SimulatedValues> values;
    std::unique_ptr<Twin> twin;
  };

  Impl(asio::io_context& io, const Protocol& its_protocol, const SimulatorOptions& its_options,
       Pty its_pty)
      : protocol(its_protocol),
        options(its_options),
        pty(std::move(its_pty)),
        descriptor(io, pty.TakeMaster()),
        timer(io) {}

  void Read();
  void OnRequestBytes(View bytes);
  void OnRequest(View frame);
  void SendPiece();
  Duration WireTime(std::size_t characters) const {
    if (!options.pace) return {};
    return static_cast<std::int64_t>(characters) * options.pace->CharacterTime();
  }

  const Protocol& protocol;
  SimulatorOptions options;
  Pty pty;
  asio::posix::stream_descriptor descriptor;
  asio::steady_timer timer;
  std::vector<std::unique_ptr<Inhabitant>> inhabitants;
  Assembler assembler;
  std::array<std::uint8_t, 1024> buffer{};
  Instant request_began{};
  Instant reply_begins{};
  Bytes reply;
  std::size_t sent = 0;
  std::atomic<std::uint64_t> answered = 0;
  std::atomic<std::uint64_t> characters = 0;
};

void Simulator::Impl::Read() {
  descriptor.async_read_some(asio::buffer(buffer),
                             [this](const asio::error_code& error, std::size_t count) {
                               if (error) return;
                               OnRequestBytes(View(buffer.data(), count));
                               Read();
                             });
}

void Simulator::Impl::OnRequestBytes(View bytes) {
  if (assembler.held() == 0) request_began = std::chrono::steady_clock::now();
  const std::size_t held = assembler.held();
  assembler.Feed(bytes);
  // A rule that ends a frame by silence is asked at once: a pty delivers a request in one piece.
  auto frame = assembler.Next(false);
  if (!frame && held == 0) frame = assembler.Next(true);
  while (frame) {
    OnRequest(*frame);
    frame = assembler.Next(false);
  }
}

void Simulator::Impl::OnRequest(View frame) {
  const Instant now = std::chrono::steady_clock::now();
  Bytes answer;
  for (const auto& inhabitant : inhabitants) {
    answer = inhabitant->twin->Answer(frame, now);
    if (!answer.empty()) break;
  }
  if (answer.empty()) return;  // what is being sent goes on
  reply = std::move(answer);
  ++answered;
  characters += frame.size() + reply.size();
  sent = 0;
  reply_begins = request_began + WireTime(frame.size()) + options.think_time;
  SendPiece();
}

/// The next piece goes out when its last character would have come over the wire.
void Simulator::Impl::SendPiece() {
  if (sent >= reply.size()) return;
  std::size_t piece = reply.size() - sent;
  if (options.pace) {
    const auto fitting = static_cast<std::size_t>(kPiece / options.pace->CharacterTime());
    piece = std::min(piece, std::max<std::size_t>(fitting, 1));
  }
  timer.expires_at(reply_begins + WireTime(sent + piece));
  timer.async_wait([this, piece, number = answered.load()](const asio::error_code& error) {
    // A wait that is over already can not be cancelled: a newer reply may stand in
    // the place of its own.
    if (error || number != answered) return;
    asio::error_code ignored;  // a full or hung-up pty loses bytes, as a wire does
    asio::write(descriptor, asio::buffer(reply.data() + sent, piece), ignored);
    sent += piece;
    SendPiece();
  });
}

Result<std::unique_ptr<Simulator>> Simulator::Create(asio::io_context& io, const Protocol& protocol,
                                                     std::vector<config::Device> devices,
                                                     const SimulatorOptions& options) {
  auto pty = Pty::Create(options.link);
  if (!pty) return Error{pty.error()};
  auto impl = std::make_unique<Impl>(io, protocol, options, std::move(*pty));
  std::uint32_t seed = 0;
  for (config::Device& device : devices) {
    auto inhabitant = std::make_unique<Impl::Inhabitant>();
    inhabitant->device = std::move(device);
    inhabitant->values = std::make_unique<SimulatedValues>(inhabitant->device.points, seed++);
    inhabitant->twin = protocol.make_twin(inhabitant->device, *inhabitant->values);
    impl->inhabitants.push_back(std::move(inhabitant));
  }
  const config::Options& shared = impl->inhabitants.front()->device.options;
  impl->assembler.Begin(protocol.request_rule, protocol.expect({}, shared));
  impl->Read();
  return std::unique_ptr<Simulator>(new Simulator(std::move(impl)));
}

Simulator::Simulator(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulator::~Simulator() = default;
const std::string& Simulator::path() const { return impl_->pty.path(); }
std::uint64_t Simulator::answered() const { return impl_->answered; }
std::uint64_t Simulator::characters() const { return impl_->characters; }

}  // namespace baudgate
