// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/target.h"

#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "gateway/base/text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/operation.h"

namespace baudgate::tools {

bool IsPort(const std::string& target) { return target.find('/') != std::string::npos; }

Status CheckTarget(const std::string& target) {
  if (IsPort(target) || target.find(':') == std::string::npos) return {};
  return Error{Quoted(target) + " is no line of a gateway; a serial server is written tcp://" +
               target};
}

namespace {

using Json = ControlClient::Json;

/// The gateway takes the port back this long after the last renewal.
constexpr Duration kLoan = 2min;
constexpr Duration kRenewAfter = 30s;

}  // namespace

std::unique_ptr<LineLoan> LineLoan::Take(const std::string& line, const std::string& socket,
                                         std::ostream& err, int& code) {
  Json status;
  code = Ask(socket, {{"command", "status"}, {"target", line}}, status, err);
  if (code != 0) return nullptr;
  const Json shown = status.value("lines", Json::array({Json::object()})).at(0);
  std::ostringstream ignored;
  code = RunRelease({.line = line, .time = kLoan, .socket = socket}, ignored, err);
  if (code != 0) return nullptr;
  std::unique_ptr<LineLoan> loan(new LineLoan(line, socket, shown.value("port", "")));
  loan->renewed_ = ReadClocks().instant;
  return loan;
}

LineLoan::~LineLoan() {
  std::ostringstream ignored;
  RunRelease({.line = line_, .end = true, .socket = socket_}, ignored, ignored);
}

void LineLoan::Renew(Instant now) {
  if (now - renewed_ < kRenewAfter) return;
  renewed_ = now;
  Json answer;
  std::ostringstream ignored;  // if the gateway has stopped, no renewal is needed
  Ask(socket_,
      {{"command", "release"},
       {"target", line_},
       {"for_ms", std::chrono::ceil<std::chrono::milliseconds>(kLoan).count()}},
      answer, ignored);
}

namespace {

/// How long a port or server may take to open.
constexpr Duration kOpening = 10s;
/// Before a request, the line must be silent for kQuiet after the last received byte. The request
/// is sent after kMostQuiet even if the line is not silent.
constexpr Duration kQuiet = 25ms;
constexpr Duration kMostQuiet = 1s;
/// A reply that takes longer than this, or has more than kMostBytes, is cut off.
constexpr Duration kMostReply = 5s;
constexpr std::size_t kMostBytes = 8192;
/// A serial server can pause for this time between two bytes of a reply.
constexpr Duration kNetworkGap = 100ms;

}  // namespace

PortWire::PortWire(const std::string& port, const config::SerialSettings& serial,
                   const StopSignals& stop)
    : stop_(io_, ::dup(stop.descriptor())), rs485_(serial.rs485.enabled) {
  line_.name = "scan";
  line_.port = port;
  line_.serial = serial;
  transport_ = transports::MakeTransport(line_, io_, *this);
  stop_.async_wait(asio::posix::stream_descriptor::wait_read,
                   [this](const asio::error_code& error) { stopped_ = stopped_ || !error; });
}

PortWire::~PortWire() { transport_->Close(); }

Result<std::unique_ptr<PortWire>> PortWire::Open(const std::string& port,
                                                 const config::SerialSettings& serial,
                                                 const StopSignals& stop) {
  std::unique_ptr<PortWire> wire(new PortWire(port, serial, stop));
  wire->transport_->Open();
  const Instant until = wire->Now() + kOpening;
  while (!wire->opened_ && !wire->is_broken() && wire->Now() < until) wire->RunUntil(until);
  if (wire->opened_) return wire;
  if (!wire->lost_.empty()) return Error{wire->lost_};
  return Error{
      wire->stopped_
          ? "stopped"
          : port + " did not open within 10s; check that its driver or serial server answers"};
}

void PortWire::OnBytes(View bytes) {
  last_byte_ = Now();
  if (heard_.size() < kMostBytes) Append(heard_, bytes);
}

/// Handles the next event; returns at `until` at the latest.
void PortWire::RunUntil(Instant until) {
  if (io_.stopped()) io_.restart();
  io_.run_one_until(until);
}

Status PortWire::Apply(const config::SerialSettings& serial) {
  config::SerialSettings whole = serial;
  whole.rs485.enabled = rs485_;
  if (const Status set = transport_->Apply(whole); !set) return set;
  line_.serial = whole;
  return {};
}

std::uint32_t PortWire::Damaged() const {
  const transports::PortCounters counters = transport_->Counters();
  return counters.parity + counters.framing;
}

Result<scan::Gathered> PortWire::Taken(Bytes early, std::uint32_t damaged_before) {
  if (!lost_.empty()) return Error{lost_};
  scan::Gathered gathered;
  gathered.early = std::move(early);
  gathered.heard = std::exchange(heard_, {});
  gathered.damaged = Damaged() - damaged_before;
  gathered.stopped = stopped_;
  return gathered;
}

Result<scan::Gathered> PortWire::Listen(Duration time) {
  heard_.clear();
  const std::uint32_t before = Damaged();
  const Instant until = Now() + time;
  while (Now() < until && !is_broken()) RunUntil(until);
  return Taken({}, before);
}

void PortWire::AwaitQuiet() {
  io_.restart();
  io_.poll();
  const Instant most = Now() + kMostQuiet;
  while (!is_broken() && Now() < most && Now() < last_byte_ + kQuiet) {
    RunUntil(std::min(most, last_byte_ + kQuiet));
  }
}

/// True if no byte but an echo of the request was received so far. A bus with an echo returns the
/// request before the reply.
bool PortWire::IsOnlyRequest(View request) const {
  return heard_.size() <= request.size() &&
         std::equal(heard_.begin(), heard_.end(), request.begin());
}

Result<scan::Gathered> PortWire::Ask(View request, Duration patience, Duration gap) {
  AwaitQuiet();
  Bytes early = std::exchange(heard_, {});
  if (is_broken()) return Taken(std::move(early), Damaged());
  const std::uint32_t before = Damaged();
  transport_->Send(request);
  Duration sending{};
  if (line_.is_network()) {
    gap = std::max(gap, kNetworkGap);
  } else {
    sending = static_cast<Duration::rep>(request.size()) * line_.serial.CharacterTime();
  }
  const Instant first = Now() + sending + patience;
  const Instant most = first + kMostReply;
  while (!is_broken()) {
    Instant until = IsOnlyRequest(request) ? first : last_byte_ + gap;
    if (!heard_.empty()) until = std::max(until, last_byte_ + gap);
    until = std::min(until, most);
    if (Now() >= until) break;
    RunUntil(until);
  }
  return Taken(std::move(early), before);
}

}  // namespace baudgate::tools
