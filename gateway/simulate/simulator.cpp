// SPDX-License-Identifier: Apache-2.0
#include "gateway/simulate/simulator.h"

#include <algorithm>
#include <array>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "gateway/line/assembler.h"
#include "gateway/simulate/pty.h"

namespace baudgate {
namespace {

constexpr double kWaveSeconds = 60;
/// A paced reply is handed over in pieces of about so long, as a UART's FIFO does.
constexpr Duration kPiece = 2ms;
/// A request that has stopped for so long, and for so many characters, is not going on.
constexpr Duration kLeastSilence = 5ms;
constexpr int kSilentCharacters = 4;
/// How soon a twin that speaks unasked says what it has to say, and how often it has something.
constexpr Duration kSpeech = 2ms;
constexpr Duration kOwnEvents = 2s;

TwinWire WireOf(const Protocol& protocol, const SimulatorOptions& options) {
  return {options.pace.value_or(protocol.serial), options.pace.has_value(), options.think_time};
}

struct Inhabitant {
  config::Device device;
  std::unique_ptr<SimulatedValues> values;
  std::unique_ptr<Twin> twin;
  std::optional<TwinEvents> events{};
};
using Inhabitants = std::vector<std::unique_ptr<Inhabitant>>;

/// `seed`: of the first; each of the others has the next one.
Inhabitants MakeTwins(const Protocol& protocol, std::vector<config::Device> devices,
                      std::uint32_t seed) {
  Inhabitants inhabitants;
  for (config::Device& device : devices) {
    auto inhabitant = std::make_unique<Inhabitant>();
    inhabitant->device = std::move(device);
    inhabitant->values = std::make_unique<SimulatedValues>(inhabitant->device.points, seed++);
    inhabitant->twin = protocol.make_twin(inhabitant->device, *inhabitant->values);
    inhabitant->twin->SetClock(ReadClocks());
    inhabitants.push_back(std::move(inhabitant));
  }
  return inhabitants;
}

/// Of the first one that does not keep silent.
Bytes AnswerOf(const Inhabitants& inhabitants, View request, Instant now) {
  for (const auto& inhabitant : inhabitants) {
    Bytes reply = inhabitant->twin->Answer(request, now);
    if (!reply.empty()) return reply;
  }
  return {};
}

}  // namespace

std::optional<std::string> FreeAddress(const Protocol& protocol,
                                       std::span<const config::Device> devices) {
  std::set<std::string> taken;
  for (const config::Device& device : devices) {
    taken.insert(protocol.canonical_address(device.address).value());
  }
  for (std::size_t number = 1; number <= devices.size() + 1; ++number) {
    const auto address = protocol.canonical_address(std::to_string(number));
    if (address && !taken.contains(*address)) return *address;
  }
  return std::nullopt;
}

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

/// Handlers that are due already run after the simulator is gone: they hold it weakly.
struct Simulator::Impl : std::enable_shared_from_this<Impl> {
  Impl(asio::io_context& io, const Protocol& its_protocol, const SimulatorOptions& its_options,
       Pty its_pty, std::vector<config::Device> devices)
      : protocol(its_protocol),
        wire(WireOf(its_protocol, its_options)),
        pty(std::move(its_pty)),
        descriptor(io, pty.TakeMaster()),
        timer(io),
        silence(io),
        speech(io),
        observer(its_options.observer),
        inhabitants(MakeTwins(protocol, std::move(devices), 0)) {
    asio::error_code ignored;
    descriptor.non_blocking(true, ignored);  // nobody need be reading
  }

  void SetFaults(const std::vector<Fault>& wanted);
  Inhabitants MakeStrangers() const;
  void Read();
  void OnRequestBytes(View bytes);
  std::optional<Bytes> NextRequest();
  void AwaitSilence();
  void OnSilence();
  void OnRequest(View frame);
  Bytes Answer(View frame, Instant now);
  void Queue(Instant until, View bytes);
  void SendNext();
  void Speak();

  const Protocol& protocol;
  TwinWire wire;
  Pty pty;
  asio::posix::stream_descriptor descriptor;
  asio::steady_timer timer;
  asio::steady_timer silence;  // while part of a request is held
  asio::steady_timer speech;   // of twins that speak unasked
  std::function<void(View, View, View)> observer;
  Inhabitants inhabitants;
  Inhabitants strangers;  // who answer in place of the inhabitants, for the fault wrong_address
  std::optional<TwinFaults> faults;
  bool was_dead = false;
  Assembler assembler;
  std::array<std::uint8_t, 1024> buffer{};
  Instant request_began{};
  Instant request_heard{};                // its last bytes
  std::multimap<Instant, Bytes> leaving;  // by when the last character of each piece is through
  Instant said_until{};                   // of the pieces that have left
  std::uint64_t waits = 0;
  std::atomic<std::uint64_t> answered = 0;
  std::atomic<std::uint64_t> characters = 0;
};

void Simulator::Impl::SetFaults(const std::vector<Fault>& wanted) {
  faults.reset();
  strangers.clear();
  if (wanted.empty()) return;
  const bool foreign = std::any_of(wanted.begin(), wanted.end(), [](const Fault& fault) {
    return fault.kind == Fault::Kind::wrong_address;
  });
  if (foreign) strangers = MakeStrangers();
  faults.emplace(wanted, wire, std::chrono::steady_clock::now(),
                 [this](View request, Instant now) { return AnswerOf(strangers, request, now); });
}

/// Devices like the inhabitants, with values of their own, that reply under one other address.
Inhabitants Simulator::Impl::MakeStrangers() const {
  std::vector<config::Device> devices;
  for (const auto& inhabitant : inhabitants) devices.push_back(inhabitant->device);
  const auto address = FreeAddress(protocol, devices);
  if (!address) return {};
  const auto seed = static_cast<std::uint32_t>(devices.size());
  Inhabitants made = MakeTwins(protocol, std::move(devices), seed);
  for (const auto& stranger : made) stranger->twin->ReplyAs(*address);
  return made;
}

void Simulator::Impl::Read() {
  descriptor.async_read_some(asio::buffer(buffer),
                             [weak = weak_from_this()](const asio::error_code& error, auto count) {
                               const auto self = weak.lock();
                               if (error || !self) return;
                               self->OnRequestBytes(View(self->buffer.data(), count));
                               self->Read();
                             });
}

void Simulator::Impl::OnRequestBytes(View bytes) {
  request_heard = std::chrono::steady_clock::now();
  if (assembler.held() == 0) request_began = request_heard;
  assembler.Feed(bytes);
  while (const auto frame = NextRequest()) OnRequest(*frame);
  AwaitSilence();
}

/// A request that only silence ends is taken at once if all that is held is one. If not, more may
/// be under way: nothing is given up yet.
std::optional<Bytes> Simulator::Impl::NextRequest() {
  if (auto frame = assembler.Next(false)) return frame;
  Assembler after_silence = assembler;
  auto frame = after_silence.Next(true);
  if (!frame || after_silence.counters().discarded != assembler.counters().discarded) return {};
  assembler = std::move(after_silence);
  return frame;
}

void Simulator::Impl::AwaitSilence() {
  silence.cancel();
  if (assembler.held() == 0) return;
  silence.expires_after(
      std::max<Duration>(kLeastSilence, kSilentCharacters * wire.serial.CharacterTime()));
  silence.async_wait([weak = weak_from_this()](const asio::error_code& error) {
    const auto self = weak.lock();
    if (error || !self) return;
    // A wait that is over already cannot be cancelled.
    if (self->silence.expiry() <= std::chrono::steady_clock::now()) self->OnSilence();
  });
}

void Simulator::Impl::OnSilence() {
  asio::posix::stream_descriptor::bytes_readable waiting(true);
  asio::error_code error;
  descriptor.io_control(waiting, error);
  if (!error && waiting.get() > 0) return;  // it was this program that was late; they are next
  while (const auto frame = assembler.Next(true)) OnRequest(*frame);
}

void Simulator::Impl::OnRequest(View frame) {
  const Instant end = std::max(request_began + wire.TimeOf(frame.size()), request_heard);
  const Bytes reply = Answer(frame, end);
  if (!reply.empty()) {
    ++answered;
    characters += frame.size() + reply.size();
  }
  Bytes delivered;
  if (faults) {
    for (const TimedPiece& piece : faults->Deliver(frame, reply, end)) {
      Append(delivered, piece.bytes);
      Queue(end + piece.after, piece.bytes);
    }
  } else if (!reply.empty()) {  // else what is being sent goes on
    leaving.clear();
    said_until = end;
    delivered = reply;
    Queue(end + wire.think + wire.TimeOf(reply.size()), reply);
  }
  if (observer) observer(frame, reply, delivered);
  SendNext();
}

Bytes Simulator::Impl::Answer(View frame, Instant now) {
  const bool dead = faults && faults->IsDead(now);
  if (std::exchange(was_dead, dead) && !dead) {
    for (const auto& inhabitant : inhabitants) {
      inhabitant->twin = protocol.make_twin(inhabitant->device, *inhabitant->values);
      inhabitant->twin->SetClock(ReadClocks());
    }
  }
  if (dead) {
    leaving.clear();
    return {};
  }
  for (const auto& one : inhabitants) {
    if (one->events) one->events->CatchUp(*one->twin, one->device, ReadClocks());
  }
  return AnswerOf(inhabitants, frame, now);
}

/// `until`: when the last of `bytes` has come over the wire.
void Simulator::Impl::Queue(Instant until, View bytes) {
  std::size_t most = bytes.size();
  if (wire.paced) {
    const auto fitting = static_cast<std::size_t>(kPiece / wire.serial.CharacterTime());
    most = std::max<std::size_t>(fitting, 1);
  }
  while (!bytes.empty()) {
    const View piece = bytes.first(std::min(most, bytes.size()));
    bytes = bytes.subspan(piece.size());
    leaving.emplace(until - wire.TimeOf(bytes.size()), Bytes(piece.begin(), piece.end()));
  }
}

/// The next piece goes out when its last character would have come over the wire, which carries one
/// character after the other whoever sends.
void Simulator::Impl::SendNext() {
  // A wait that is over already cannot be cancelled: its piece may not be the next any more.
  const std::uint64_t number = ++waits;
  timer.cancel();
  if (leaving.empty()) return;
  const auto& [until, bytes] = *leaving.begin();
  const Instant at = std::max(until, said_until + wire.TimeOf(bytes.size()));
  timer.expires_at(at);
  timer.async_wait([weak = weak_from_this(), at, number](const asio::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || number != self->waits) return;
    const auto piece = self->leaving.extract(self->leaving.begin());
    self->said_until = at;
    asio::error_code ignored;  // a full or hung-up pty loses bytes, as a wire does
    asio::write(self->descriptor, asio::buffer(piece.mapped()), ignored);
    self->SendNext();
  });
}

/// Twins that speak unasked are asked, as it were, again and again whether they want to.
void Simulator::Impl::Speak() {
  const Now now = ReadClocks();
  bool spoke = false;
  for (const auto& one : inhabitants) {
    if (one->events) one->events->CatchUp(*one->twin, one->device, now);
    for (Bytes message = one->twin->Say(now.instant); !message.empty();
         message = one->twin->Say(now.instant)) {
      const Instant free = leaving.empty() ? now.instant : leaving.rbegin()->first;
      Queue(std::max(now.instant, free) + wire.TimeOf(message.size()), message);
      ++answered;
      characters += message.size();
      spoke = true;
    }
  }
  if (spoke) SendNext();
  speech.expires_after(kSpeech);
  speech.async_wait([weak = weak_from_this()](const asio::error_code& error) {
    const auto self = weak.lock();
    if (!error && self) self->Speak();
  });
}

Result<std::unique_ptr<Simulator>> Simulator::Create(asio::io_context& io, const Protocol& protocol,
                                                     std::vector<config::Device> devices,
                                                     const SimulatorOptions& options) {
  auto pty = Pty::Create(options.link);
  if (!pty) return Error{pty.error()};
  auto impl = std::make_shared<Impl>(io, protocol, options, std::move(*pty), std::move(devices));
  impl->SetFaults(options.faults);
  auto events = options.events;
  if (!events && protocol.unasked) events = EventSchedule{.every = kOwnEvents};
  for (const auto& one : impl->inhabitants) {
    if (events) one->events.emplace(*events, ReadClocks());
  }
  const config::Options& shared = impl->inhabitants.front()->device.options;
  impl->assembler.Begin(protocol.request_rule, protocol.expect({}, shared));
  impl->Read();
  if (protocol.unasked) impl->Speak();
  return std::unique_ptr<Simulator>(new Simulator(std::move(impl)));
}

Simulator::Simulator(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulator::~Simulator() = default;
const std::string& Simulator::path() const { return impl_->pty.path(); }
std::uint64_t Simulator::answered() const { return impl_->answered; }
std::uint64_t Simulator::characters() const { return impl_->characters; }
std::vector<FaultCount> Simulator::fault_counts() const {
  return impl_->faults ? impl_->faults->Counts() : std::vector<FaultCount>();
}

std::pair<std::uint64_t, std::uint64_t> Simulator::event_counts() const {
  std::pair<std::uint64_t, std::uint64_t> counts;
  for (const auto& one : impl_->inhabitants) {
    counts.first += one->events ? one->events->raised() : 0;
    counts.second += one->events ? one->events->refused() : 0;
  }
  return counts;
}

void Simulator::SetFaults(const std::vector<Fault>& faults) { impl_->SetFaults(faults); }

}  // namespace baudgate
