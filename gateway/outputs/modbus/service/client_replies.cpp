// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/client_replies.h"

#include <utility>

namespace baudgate::modbus {
namespace {

/// The gateway itself answers so, not a device. A silent listener does not send it.
bool IsGatewayTrouble(ExceptionCode exception) {
  return exception == kNoPath || exception == kNoTarget || exception == kBusy;
}

}  // namespace

ClientReplies::ClientReplies(const config::Listener& listener, ClientWire& wire,
                             LiveCounters& counters, std::shared_ptr<TrafficBook> book,
                             const std::string& peer, config::Priority priority, WallTime since)
    : listener_(listener),
      wire_(wire),
      counters_(counters),
      book_(std::move(book)),
      record_(book_->Enter(peer, listener, priority, since)),
      client_{peer, record_->id} {}

void ClientReplies::OnRequest(View frame, Instant now) {
  LiveCounters::Add(counters_.requests);
  ClientRecord::Add(record_->requests);
  ClientRecord::Add(record_->bytes_in, BytesOnWire(frame.size()));
  record_->last_request.store(now, std::memory_order_relaxed);
}

void ClientReplies::Answer(const ModbusRequest& request, Responder& responder, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(ReplySize(request)));
  record_->functions->Add(request.function);
  wire_.Answer(request, responder, now);
}

void ClientReplies::Answer(View frame, Instant now) {
  ClientRecord::Add(record_->bytes_out, BytesOnWire(frame.size()));
  const std::uint8_t function = FunctionOf(frame);
  const bool refused = (function & kExceptionBit) != 0 && frame.size() > kMbapHeader + 1;
  record_->functions->Add(function & ~kExceptionBit, refused ? frame[kMbapHeader + 1] : 0);
  wire_.Answer(frame, now);
}

void ClientReplies::Refuse(View frame, ExceptionCode exception, Instant now) {
  const bool silent = listener_.errors == config::Listener::Errors::silent;
  const bool kept = silent && IsGatewayTrouble(exception);
  if (kept || !IsAwaited(frame)) return wire_.AnswerNothing(now);
  CountException();
  Answer(ExceptionReply(frame, exception), now);
}

void ClientReplies::CountException() {
  LiveCounters::Add(counters_.exceptions);
  ClientRecord::Add(record_->exceptions);
}

/// On a serial wire a write to unit 0 goes to all, wherever a route may lead it: its sender waits
/// for no answer, and would take one for the reply to its next request.
bool ClientReplies::IsAwaited(View request) const {
  const bool to_all =
      listener_.speaks_serial() && UnitOf(request) == 0 && IsPlainWrite(FunctionOf(request));
  return !to_all;
}

void ClientReplies::Await(Instant limit) {
  record_->outstanding.fetch_add(1, std::memory_order_relaxed);
  wire_.SweepAt(limit);
}

void ClientReplies::Settle(std::size_t count) {
  record_->outstanding.fetch_sub(static_cast<std::uint32_t>(count), std::memory_order_relaxed);
}

void ClientReplies::HeardOther(Framing heard, WallTime at) {
  book_->HeardOther(listener_.Place(), client_.name, heard, listener_.framing, at);
}

std::size_t ClientReplies::BytesOnWire(std::size_t frame) const {
  constexpr std::size_t kRtuFrame = 3;    // address and CRC
  constexpr std::size_t kAsciiFrame = 3;  // colon, CR and LF; around address, PDU and LRC in hex
  const std::size_t pdu = frame - kMbapHeader;
  switch (listener_.framing) {
    case Framing::tcp:
      break;
    case Framing::rtu:
      return pdu + kRtuFrame;
    case Framing::ascii:
      return 2 * (pdu + 2) + kAsciiFrame;
  }
  return frame;
}

}  // namespace baudgate::modbus
