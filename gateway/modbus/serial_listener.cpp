// Hears a serial master, keeps to the times of its bus, and keeps the port open.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial_listener.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "gateway/modbus/mbap.h"
#include "transports/serial_port.h"

namespace baudgate::modbus {
namespace {

/// USB adapters hand over what they have every 16 ms at worst, in the middle of a frame, too. Most
/// requests end by their length and do not wait for this.
constexpr Duration kUsbGap = 20ms;

Instant Clock() { return std::chrono::steady_clock::now(); }

}  // namespace

SerialListener::SerialListener(asio::io_context& io, const config::Listener& listener,
                               Service& service, const Protocol& rtu)
    : listener_(listener),
      service_(service),
      place_(service.book()->AddMaster(listener.path)),
      rtu_(rtu),
      quiet_(*rtu.timing(listener.serial).quiet),
      gap_(std::max(quiet_, kUsbGap)),
      transport_(MakeSerialPort(listener.path, listener.serial, io, *this)),
      keeper_(io, listener.path, [this] { Open(); }),
      timer_(io) {}

// ---------------------------------------------------------------- the port

void SerialListener::Open() { transport_->Open(); }

void SerialListener::Stop() {
  if (std::exchange(stopped_, true)) return;
  keeper_.Stop();
  transport_->Close();
  Forget();
}

void SerialListener::OnOpened() {
  keeper_.OnOpened();
  spdlog::info("modbus: listening for a master on {}", transport_->Describe());
  service_.book()->ShowPort(place_, true, transport_->Describe());
  assembler_.Begin(rtu_.request_rule, rtu_.expect({}, {}));
  echo_.Reset();
  desk_ = std::make_shared<RequestDesk>(timer_.get_executor(), listener_, service_, *this,
                                        listener_.path, listener_.priority);
}

void SerialListener::OnLost(const std::string& reason) {
  Forget();
  Down(reason);
}

/// What was heard, and what waits to be answered.
void SerialListener::Forget() {
  timer_.cancel();
  awaited_.reset();
  reply_.clear();
  if (desk_) std::exchange(desk_, nullptr)->Close();
}

void SerialListener::Down(const std::string& reason) {
  if (!keeper_.OnDown(reason)) return;
  spdlog::warn("modbus: no master is heard on {}: {}; trying again until it works", listener_.path,
               reason);
  service_.book()->ShowPort(place_, false, reason);
}

// ---------------------------------------------------------------- requests

void SerialListener::OnBytes(View bytes) {
  last_byte_ = Clock();
  assembler_.Feed(echo_.Filter(bytes, last_byte_));
  CutFrames(false);
  Arm();
}

void SerialListener::CutFrames(bool silent) {
  while (const auto frame = assembler_.Next(silent)) OnFrame(*frame);
  if (assembler_.held() > 0 || assembler_.blame() == Outcome::none) return;
  service_.book()->HeardDamage(place_);
  assembler_.Begin(rtu_.request_rule, rtu_.expect({}, {}));
}

/// A request for another slave, too, says that the master waits for us no longer. Whoever sends to
/// all waits for nobody.
void SerialListener::OnFrame(const Bytes& frame) {
  service_.book()->Heard(place_);
  const auto request = rtu_.carrier->unwrap_request(frame);
  if (!request) return;
  echo_.OnRequest(frame.size());
  reply_.clear();
  request_ = frame;
  awaited_ = ++transaction_;
  const Bytes adu = AduOf(transaction_, request->first, request->second);
  if (request->first == 0) {
    awaited_.reset();
    if (!IsWrite(adu)) return;
  }
  desk_->GiveUp();
  desk_->Handle(adu, last_byte_);
}

// ---------------------------------------------------------------- replies

void SerialListener::Answer(const ModbusRequest& request, Responder& responder) {
  Bytes frame;
  if (responder.Append(request, frame)) Answer(frame);
}

void SerialListener::Answer(View frame) {
  if (awaited_ != ByteReader(frame).U16Be(0)) return;
  awaited_.reset();
  reply_ = rtu_.carrier->wrap(UnitOf(frame), frame.subspan(kMbapHeader));
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
  const Instant now = Clock();
  if (HoldsBytes() && now >= last_byte_ + gap_) {
    assembler_.Feed(echo_.OnSilence());
    CutFrames(true);
  }
  if (!HoldsBytes() && !reply_.empty() && now >= last_byte_ + quiet_) SendReply();
  Arm();
}

void SerialListener::SendReply() {
  const Bytes reply = std::exchange(reply_, {});
  const auto characters = static_cast<int>(reply.size());
  const Duration sending = characters * listener_.serial.CharacterTime();
  echo_.OnSent(request_, reply, Clock() + sending + quiet_);
  transport_->Send(reply);
}

}  // namespace baudgate::modbus
