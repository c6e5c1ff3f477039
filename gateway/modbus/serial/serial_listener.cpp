// Hears a serial master and keeps to the times of its bus.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial/serial_listener.h"

#include <algorithm>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/modbus/wire/mbap.h"
#include "transports/serial_port.h"

namespace baudgate::modbus {
namespace {

/// USB adapters hand over what they have every 16 ms at worst, in the middle of a frame, too. Most
/// requests end by their length and do not wait for this.
constexpr Duration kUsbGap = 20ms;

}  // namespace

SerialListener::SerialListener(asio::io_context& io, const config::Listener& listener,
                               PointDesk& points, const Protocol& rtu)
    : listener_(listener),
      points_(points),
      place_(points.book()->AddMaster(listener.path, ReadClocks().wall)),
      rtu_(rtu),
      quiet_(*rtu.timing(listener.serial).quiet),
      gap_(std::max(quiet_, kUsbGap)),
      port_(
          io, listener.path,
          [&listener](asio::io_context& port_io, TransportListener& heard) {
            return MakeSerialPort(listener.path, listener.serial, port_io, heard);
          },
          *this),
      timer_(io) {}

// ---------------------------------------------------------------- the port

void SerialListener::Open() { port_.Start(); }

void SerialListener::Stop() {
  port_.Stop();
  Forget();
}

void SerialListener::OnOpened(const std::string& description) {
  log::Info("modbus: listening for a master on {}", description);
  points_.book()->ShowPort(place_, true, description, ReadClocks().wall);
  assembler_.Begin(rtu_.request_rule, rtu_.expect({}, {}));
  echo_.Reset();
  desk_ = std::make_shared<RequestDesk>(timer_.get_executor(), listener_, points_, *this,
                                        listener_.path, listener_.priority);
}

void SerialListener::OnDown(const std::string& reason, bool is_news) {
  Forget();
  if (!is_news) return;
  log::Warn("modbus: no master is heard on {}: {}; trying again until it works", listener_.path,
            reason);
  points_.book()->ShowPort(place_, false, reason, ReadClocks().wall);
}

/// What was heard, and what waits to be answered.
void SerialListener::Forget() {
  timer_.cancel();
  awaited_.reset();
  reply_.clear();
  if (desk_) std::exchange(desk_, nullptr)->Close();
}

// ---------------------------------------------------------------- requests

void SerialListener::OnBytes(View bytes, Instant at) {
  last_byte_ = at;
  assembler_.Feed(echo_.Filter(bytes, last_byte_));
  CutFrames(false);
  Arm();
}

void SerialListener::CutFrames(bool silent) {
  while (const auto frame = assembler_.Next(silent)) OnFrame(*frame);
  if (assembler_.held() > 0 || assembler_.blame() == Outcome::none) return;
  points_.book()->HeardDamage(place_);
  assembler_.Begin(rtu_.request_rule, rtu_.expect({}, {}));
}

/// A request for another slave, too, says that the master waits for us no longer. Whoever sends to
/// all waits for nobody.
void SerialListener::OnFrame(const Bytes& frame) {
  const ReplyEcho::Heard heard = echo_.OnRequest(frame);
  if (heard == ReplyEcho::Heard::echo) return;
  points_.book()->Heard(place_, ReadClocks().wall);
  const auto request = rtu_.carrier->unwrap_request(frame);
  if (!request) return;
  if (heard == ReplyEcho::Heard::doubt) return OnDoubt(frame, request->first, request->second[0]);
  const auto& [unit, pdu] = *request;
  reply_.clear();
  awaited_.reset();
  desk_->GiveUp();
  const Bytes adu = AduOf(++transaction_, unit, pdu);
  const bool silent = listener_.errors == config::Listener::Errors::silent;
  const bool another = silent && points_.WayOf(unit).kind == Way::Kind::none;
  if (another || (unit == 0 && !IsPlainWrite(FunctionOf(adu)))) return;
  request_ = frame;
  if (unit != 0) awaited_ = transaction_;
  desk_->Handle(adu, last_byte_);
}

/// What the master has asked meanwhile goes before: if this is an echo, it still waits for that.
/// "Busy" is said even where errors are silent, for it makes the master repeat its write at once.
void SerialListener::OnDoubt(const Bytes& frame, std::uint8_t unit, std::uint8_t function) {
  if (awaited_ || !reply_.empty()) return;
  request_ = frame;
  reply_ = rtu_.carrier->wrap(unit, Exception(function, kBusy));
  Arm();
}

// ---------------------------------------------------------------- replies

void SerialListener::Answer(const ModbusRequest& request, Responder& responder) {
  Bytes frame;
  if (responder.Append(request, frame)) Answer(frame);
}

void SerialListener::Answer(View frame) {
  if (awaited_ != ByteReader(frame).U16Be(0)) return;
  awaited_.reset();
  reply_ = rtu_.carrier->wrap(UnitOf(frame), PduOf(frame));
  Arm();
}

/// A reply waits for the quiet before it, and until it is certain that what has come since its
/// request is no new one.
void SerialListener::Arm() {
  if (!HoldsBytes() && reply_.empty()) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(last_byte_ + (HoldsBytes() ? gap_ : quiet_));
  timer_.async_wait([self = weak_from_this()](const asio::error_code& error) {
    const auto listener = self.lock();
    if (!error && listener && listener->desk_) listener->OnTimer();
  });
}

void SerialListener::OnTimer() {
  const Instant now = ReadClocks().instant;
  if (HoldsBytes() && now >= last_byte_ + gap_) {
    assembler_.Feed(echo_.OnSilence());
    CutFrames(true);
  }
  if (!HoldsBytes() && !reply_.empty() && now >= last_byte_ + quiet_) SendReply(now);
  Arm();
}

void SerialListener::SendReply(Instant now) {
  Bytes reply = std::exchange(reply_, {});
  const auto characters = static_cast<int>(reply.size());
  const Duration sending = characters * listener_.serial.CharacterTime();
  echo_.OnSent(request_, reply, now + sending + quiet_);
  port_.Send(std::move(reply));
}

}  // namespace baudgate::modbus
