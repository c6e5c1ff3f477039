// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/serial/serial_listener.h"

#include <algorithm>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "transports/serial_port.h"

namespace baudgate::modbus {

void ReplyEcho::OnSent(View reply, Instant until) {
  filter_.OnExchangeEnd();
  filter_.OnSent(reply);
  owed_.assign(reply.begin(), reply.end());
  until_ = until;
}

Bytes ReplyEcho::Filter(View received) {
  if (!strips_) return Bytes(received.begin(), received.end());
  bus::EchoResult result = filter_.Filter(received);
  if (result.complete) owed_.clear();
  return std::move(result.bytes);
}

bool ReplyEcho::IsEcho(View frame, Instant ended) {
  const Bytes owed = std::exchange(owed_, {});
  return !owed.empty() && ended <= until_ && std::ranges::equal(owed, frame);
}

namespace {

/// The longest pause within an RTU frame: USB adapters deliver bytes up to 16 ms late. At low bit
/// rates the quiet time of the line is longer and counts instead. Most requests are recognised by
/// their length and do not wait for this time.
constexpr Duration kUsbGap = 20ms;
/// The longest pause between two characters of a Modbus ASCII frame (MODBUS over Serial Line 1.02,
/// 2.5.2.1).
constexpr Duration kAsciiGap = 1s;

}  // namespace

MasterSession::MasterSession(const config::Listener& listener, ServerShared& shared,
                             std::size_t port, Owner& owner, const Now& now)
    : listener_(listener),
      frames_(shared.frames()),
      book_(*shared.book()),
      port_(port),
      owner_(owner),
      quiet_(*protocol().timing(listener.serial).quiet),
      gap_(listener.framing == Framing::ascii ? kAsciiGap : std::max(quiet_, kUsbGap)),
      requests_(listener, shared, *this, listener.path, listener.priority, nullptr, now),
      echo_(listener.echo) {
  assembler_.Begin(protocol().request_rule, protocol().expect({}, {}));
}

void MasterSession::OnBytes(View bytes, const Now& now) {
  if (now.instant - last_byte_ >= gap_) heard_.clear();
  last_byte_ = now.instant;
  Append(heard_, bytes.first(std::min(bytes.size(), kMostLookedAt - heard_.size())));
  assembler_.Feed(echo_.Filter(bytes));
  CutFrames(false, now);
}

void MasterSession::CutFrames(bool silent, const Now& now) {
  while (const auto frame = assembler_.Next(silent)) OnFrame(*frame, now);
  if (!heard_.empty()) NameOther();
  if (assembler_.held() > 0 || assembler_.blame() == Outcome::none) return;
  book_.HeardDamage(port_);
  assembler_.Begin(protocol().request_rule, protocol().expect({}, {}));
}

/// Logs a warning if the bytes since the last pause or frame are a request in another framing (RTU
/// or ASCII).
void MasterSession::NameOther() {
  const auto other = OtherFraming(heard_, listener_.framing, frames_);
  if (!other || !book_.HeardOther(port_, *other)) return;
  log::Warn("modbus: no reply to the master on {}: {}", listener_.path,
            ExplainOther(*other, listener_.framing));
}

/// Handles a whole frame. Any request, even a broadcast or a request to another slave, shows that
/// the master no longer waits for the gateway's earlier reply.
void MasterSession::OnFrame(const Bytes& frame, const Now& now) {
  if (echo_.IsEcho(frame, last_byte_)) {
    if (listener_.echo == config::Listener::Echo::off) book_.HeardEcho(port_);
    return;
  }
  book_.Heard(port_, now.wall);
  heard_.clear();
  const auto request = protocol().carrier->unwrap_request(frame);
  if (!request) return;
  const auto& [unit, pdu] = *request;
  reply_.clear();
  awaited_.reset();
  requests_.Abandon();
  const bool silent = listener_.errors == config::Listener::Errors::silent;
  const bool another = silent && !requests_.Serves(unit);
  if (another || (unit == 0 && !IsPlainWrite(pdu[0]))) return;
  ++transaction_;
  if (unit != 0) awaited_ = transaction_;
  requests_.Handle(AduOf(transaction_, unit, pdu), {last_byte_, now.wall});
}

void MasterSession::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  Bytes frame;
  responder.Append(request, frame);
  Answer(frame, now);
}

void MasterSession::Answer(View frame, Instant) {
  if (awaited_ != TransactionOf(frame)) return;
  awaited_.reset();
  reply_ = protocol().carrier->wrap(UnitOf(frame), PduOf(frame));
  owner_.Rearm();
}

std::optional<Instant> MasterSession::Deadline() const {
  std::optional<Instant> next;
  if (HoldsBytes()) {
    next = last_byte_ + gap_;
  } else if (!reply_.empty()) {
    next = last_byte_ + quiet_;
  }
  return Soonest({next, requests_.Deadline()});
}

void MasterSession::OnTime(const Now& now) {
  if (HoldsBytes() && now.instant >= last_byte_ + gap_) {
    assembler_.Feed(echo_.OnSilence());
    CutFrames(true, now);
  }
  if (!HoldsBytes() && !reply_.empty() && now.instant >= last_byte_ + quiet_) {
    SendReply(now.instant);
  }
  requests_.Sweep(now);
}

void MasterSession::SendReply(Instant now) {
  Bytes reply = std::exchange(reply_, {});
  const auto characters = static_cast<int>(reply.size());
  const Duration sending = characters * listener_.serial.CharacterTime();
  echo_.OnSent(reply, now + sending + ReplyEcho::kLatest);
  owner_.Send(std::move(reply));
}

SerialListener::SerialListener(asio::io_context& io, config::Listener listener,
                               ServerShared& shared)
    : listener_(std::move(listener)),
      shared_(shared),
      book_(*shared.book()),
      port_(
          io, listener_.path,
          [this](asio::io_context& port_io, transports::TransportListener& heard) {
            return MakeSerialPort(listener_.path, listener_.serial, port_io, heard);
          },
          *this),
      place_(book_.AddMaster(listener_, ReadClocks().wall)),
      timer_(io) {}

void SerialListener::Leave() {
  if (std::exchange(left_, true)) return;
  timer_.cancel();
  session_.reset();
  book_.RemoveMaster(place_);
}

void SerialListener::Stop() {
  Leave();
  ClosePort();
}

void SerialListener::OnOpened(const std::string& description) {
  if (left_) return;
  const Now now = ReadClocks();
  log::Info("modbus: listening for a master on {}", description);
  book_.ShowPort(place_, true, description, now.wall);
  session_.emplace(listener_, shared_, place_, *this, now);
}

void SerialListener::OnDown(const std::string& reason, bool is_news) {
  if (left_) return;
  timer_.cancel();
  session_.reset();
  if (!is_news) return;
  log::Warn(
      "modbus: cannot open {} to listen for a master: {}; the gateway tries again until the port "
      "opens",
      listener_.path, reason);
  book_.ShowPort(place_, false, reason, ReadClocks().wall);
}

void SerialListener::OnBytes(View bytes, Instant at) {
  if (!session_) return;
  session_->OnBytes(bytes, {at, ReadClocks().wall});
  Rearm();
}

void SerialListener::Rearm() {
  const auto next = session_->Deadline();
  if (!next) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*next);
  timer_.async_wait([self = weak_from_this()](const asio::error_code& error) {
    const auto listener = self.lock();
    if (error || !listener || !listener->session_) return;
    listener->session_->OnTime(ReadClocks());
    listener->Rearm();
  });
}

}  // namespace baudgate::modbus
