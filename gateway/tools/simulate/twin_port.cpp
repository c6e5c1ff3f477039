// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/twin_port.h"

#include <algorithm>
#include <asio/write.hpp>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "transports/serial_settings.h"

namespace baudgate::tools {
namespace {

using config::Parity;
using config::SerialSettings;

/// The largest difference of bit rates, in per mille, at which a receiver still samples every bit
/// of a character correctly.
constexpr long kTolerancePerMille = 30;

bool ParityBit(unsigned data, Parity parity) {
  if (parity == Parity::mark || parity == Parity::space) return parity == Parity::mark;
  const bool odd = std::popcount(data) % 2 != 0;
  return parity == Parity::even ? odd : !odd;
}

unsigned DataOf(std::uint8_t byte, const SerialSettings& serial) {
  return serial.data_bits == 7 ? byte & 0x7FU : byte;
}

/// Returns the level of the wire for each bit. The wire is idle (1) before and after.
std::vector<bool> BitsOf(View sent, const SerialSettings& serial) {
  std::vector<bool> bits = {true};
  for (const std::uint8_t byte : sent) {
    const unsigned data = DataOf(byte, serial);
    bits.push_back(false);
    for (int bit = 0; bit < serial.data_bits; ++bit) bits.push_back(((data >> bit) & 1U) != 0);
    if (serial.parity != Parity::none) bits.push_back(ParityBit(data, serial.parity));
    for (int stop = 0; stop < serial.stop_bits; ++stop) bits.push_back(true);
  }
  return bits;
}

/// The level of a wire over time. One unit of time is 1 / (sender's bit rate * receiver's bit rate)
/// seconds, so that a bit of the sender and a bit of the receiver last whole numbers of units.
class Wire {
 public:
  Wire(std::vector<bool> bits, std::int64_t bit) : bits_(std::move(bits)), bit_(bit) {}

  bool At(std::int64_t time) const {
    const auto index = static_cast<std::size_t>(time / bit_);
    return index >= bits_.size() || bits_[index];
  }
  /// Returns the first time, not before `time`, at which the wire has `level`; negative: never.
  std::int64_t Next(bool level, std::int64_t time) const {
    if (At(time) == level) return time;
    for (std::int64_t index = time / bit_ + 1; index <= Size(); ++index) {
      if (At(index * bit_) == level) return index * bit_;
    }
    return -1;
  }

 private:
  std::int64_t Size() const { return static_cast<std::int64_t>(bits_.size()); }

  const std::vector<bool> bits_;
  const std::int64_t bit_;
};

}  // namespace

Received ReceiveAs(const SerialSettings& receiver, View sent, const SerialSettings& sender) {
  const Wire wire(BitsOf(sent, sender), receiver.baud);
  const std::int64_t bit = sender.baud;
  Received received;
  for (std::int64_t start = wire.Next(false, 0); start >= 0;) {
    std::int64_t at = start + bit / 2;
    if (wire.At(at)) {  // the pulse is too short for a start bit
      start = wire.Next(false, at);
      continue;
    }
    unsigned data = 0;
    for (int i = 0; i < receiver.data_bits; ++i) {
      at += bit;
      if (wire.At(at)) data |= 1U << i;
    }
    bool whole = true;
    if (receiver.parity != Parity::none) {
      at += bit;
      whole = wire.At(at) == ParityBit(data, receiver.parity);
    }
    at += bit;
    whole = wire.At(at) && whole;
    received.bytes.push_back(whole ? static_cast<std::uint8_t>(data) : std::uint8_t{0});
    if (!whole) ++received.damaged;
    const std::int64_t idle = wire.Next(true, at);
    start = idle < 0 ? -1 : wire.Next(false, idle);
  }
  return received;
}

bool Understand(const SerialSettings& a, const SerialSettings& b) {
  const long difference = std::labs(static_cast<long>(a.baud) - b.baud);
  return difference * 1000 <= kTolerancePerMille * a.baud && a.data_bits == b.data_bits &&
         a.parity == b.parity;
}

namespace {

/// A paced reply is sent in pieces of this duration, as a UART with a FIFO would send it.
constexpr Duration kPiece = 2ms;
/// A request has ended when the line was silent for this time and for this many characters.
constexpr Duration kLeastSilence = 5ms;
constexpr int kSilentCharacters = 4;
/// The interval at which simulated devices are asked for messages that they send unasked.
constexpr Duration kSpeech = 2ms;

}  // namespace

TwinPort::TwinPort(asio::io_context& io, int descriptor, std::shared_ptr<TwinBus> bus)
    : bus_(std::move(bus)),
      fd_(descriptor),
      descriptor_(io, descriptor),
      timer_(io),
      silence_(io),
      speech_(io) {
  asio::error_code ignored;
  descriptor_.non_blocking(true, ignored);  // a write must not block if no program reads
  for (const auto& residents : bus_->residents) {
    const protocols::Protocol& protocol = residents->protocol();
    assemblers_.emplace_back().Begin(protocol.request_rule,
                                     protocol.expect({}, residents->options()));
  }
}

void TwinPort::Start() {
  Read();
  for (const auto& residents : bus_->residents) {
    if (residents->speaks_unasked()) return Speak();
  }
}

void TwinPort::Close() {
  asio::error_code ignored;
  over_ = true;
  descriptor_.close(ignored);
}

void TwinPort::Read() {
  descriptor_.async_read_some(asio::buffer(buffer_),
                              [weak = weak_from_this()](const asio::error_code& error, auto count) {
                                const auto self = weak.lock();
                                if (!self) return;
                                if (error) {
                                  self->over_ = true;
                                  return;
                                }
                                self->OnRequestBytes(View(self->buffer_.data(), count));
                                self->Read();
                              });
}

std::size_t TwinPort::Held() const {
  std::size_t held = 0;
  for (const protocols::Assembler& assembler : assemblers_) held = std::max(held, assembler.held());
  return held;
}

/// Returns what the simulated devices' UART receives of `bytes` from a reader that uses other
/// serial settings. If the bit rates differ or a character is damaged, returns `bytes` unchanged:
/// the simulated devices then answer, and the reader receives their replies damaged.
Bytes TwinPort::AsSent(Residents& residents, View bytes) const {
  const Bytes as_they_are(bytes.begin(), bytes.end());
  if (!bus_->strict) return as_they_are;
  const config::SerialSettings& own = residents.serial();
  const auto user = transports::ReadPtyFormat(fd_, own);
  if (Understand(own, user)) return as_they_are;
  Received received = ReceiveAs(own, bytes, user);
  return received.damaged == 0 && user.baud == own.baud ? std::move(received.bytes) : as_they_are;
}

void TwinPort::OnRequestBytes(View bytes) {
  request_heard_ = std::chrono::steady_clock::now();
  if (Held() == 0) request_began_ = request_heard_;
  for (std::size_t i = 0; i < assemblers_.size(); ++i) {
    Residents& residents = *bus_->residents[i];
    assemblers_[i].Feed(AsSent(residents, bytes));
    while (const auto frame = NextRequest(assemblers_[i])) OnRequest(residents, *frame);
  }
  AwaitSilence();
}

/// Returns the next request; empty: no whole request has come. A request that only a silence would
/// end is returned at once, unless the assembler would discard bytes: then more bytes may follow,
/// and the assembler stays unchanged.
std::optional<Bytes> TwinPort::NextRequest(protocols::Assembler& assembler) {
  if (auto frame = assembler.Next(false)) return frame;
  protocols::Assembler after_silence = assembler;
  auto frame = after_silence.Next(true);
  if (!frame || after_silence.counters().discarded != assembler.counters().discarded) return {};
  assembler = std::move(after_silence);
  return frame;
}

void TwinPort::AwaitSilence() {
  silence_.cancel();
  if (Held() == 0) return;
  silence_.expires_after(
      std::max<Duration>(kLeastSilence, kSilentCharacters * bus_->wire.serial.CharacterTime()));
  silence_.async_wait([weak = weak_from_this()](const asio::error_code& error) {
    const auto self = weak.lock();
    if (error || !self) return;
    // A timer that has already expired cannot be cancelled, so its handler checks the time.
    if (self->silence_.expiry() <= std::chrono::steady_clock::now()) self->OnSilence();
  });
}

void TwinPort::OnSilence() {
  asio::posix::stream_descriptor::bytes_readable waiting(true);
  asio::error_code error;
  descriptor_.io_control(waiting, error);
  // Bytes wait to be read, because this program was late. So the line was not silent.
  if (!error && waiting.get() > 0) return;
  for (std::size_t i = 0; i < assemblers_.size(); ++i) {
    while (const auto frame = assemblers_[i].Next(true)) OnRequest(*bus_->residents[i], *frame);
  }
}

void TwinPort::OnRequest(Residents& residents, View frame) {
  const Instant end = std::max(request_began_ + bus_->wire.TimeOf(frame.size()), request_heard_);
  const Residents::Answer answer = residents.Hear(frame, end);
  if (!answer.reply.empty()) {
    ++bus_->answered;
    bus_->characters += frame.size() + answer.reply.size();
  }
  if (answer.interrupts) {
    leaving_.clear();
    said_until_ = end;
  }
  Bytes delivered;
  for (const TimedPiece& piece : answer.heard) {
    Append(delivered, Queue(end + piece.after, piece.bytes, answer.serial));
  }
  if (bus_->observer) bus_->observer(frame, answer.reply, delivered);
  SendNext();
}

Bytes TwinPort::AsReceived(View bytes, const config::SerialSettings& speaker) const {
  if (bus_->strict) {
    const config::SerialSettings user = transports::ReadPtyFormat(fd_, speaker);
    if (!Understand(speaker, user)) return ReceiveAs(user, bytes, speaker).bytes;
  }
  return {bytes.begin(), bytes.end()};
}

/// Adds `bytes` to the pieces to send. Their last character is sent at `until`. Returns the bytes
/// as the reader receives them.
Bytes TwinPort::Queue(Instant until, View bytes, const config::SerialSettings& speaker) {
  const Bytes heard = AsReceived(bytes, speaker);
  View rest = heard;
  std::size_t most = rest.size();
  if (bus_->wire.paced) {
    const auto fitting = static_cast<std::size_t>(kPiece / bus_->wire.serial.CharacterTime());
    most = std::max<std::size_t>(fitting, 1);
  }
  while (!rest.empty()) {
    const View piece = rest.first(std::min(most, rest.size()));
    rest = rest.subspan(piece.size());
    leaving_.emplace(until - bus_->wire.TimeOf(rest.size()), Bytes(piece.begin(), piece.end()));
  }
  return heard;
}

/// Waits until the last character of the next piece would be sent, and sends the piece. The wire
/// carries one character at a time, whichever simulated device sends.
void TwinPort::SendNext() {
  // A timer that has already expired cannot be cancelled, so its handler checks `number`.
  const std::uint64_t number = ++waits_;
  timer_.cancel();
  if (leaving_.empty()) return;
  const auto& [until, bytes] = *leaving_.begin();
  const Instant at = std::max(until, said_until_ + bus_->wire.TimeOf(bytes.size()));
  timer_.expires_at(at);
  timer_.async_wait([weak = weak_from_this(), at, number](const asio::error_code& error) {
    const auto self = weak.lock();
    if (error || !self || number != self->waits_) return;
    const auto piece = self->leaving_.extract(self->leaving_.begin());
    self->said_until_ = at;
    asio::error_code ignored;  // a full or closed pty loses bytes, like a wire
    asio::write(self->descriptor_, asio::buffer(piece.mapped()), ignored);
    self->SendNext();
  });
}

/// Asks the simulated devices for messages that they send unasked, and repeats this every kSpeech.
void TwinPort::Speak() {
  const Now now = ReadClocks();
  bool spoke = false;
  for (const auto& residents : bus_->residents) {
    for (Bytes message = residents->Say(now); !message.empty(); message = residents->Say(now)) {
      const Instant free = leaving_.empty() ? now.instant : leaving_.rbegin()->first;
      Queue(std::max(now.instant, free) + bus_->wire.TimeOf(message.size()), message,
            residents->serial());
      ++bus_->answered;
      bus_->characters += message.size();
      spoke = true;
    }
  }
  if (spoke) SendNext();
  if (over_) return;
  speech_.expires_after(kSpeech);
  speech_.async_wait([weak = weak_from_this()](const asio::error_code& error) {
    const auto self = weak.lock();
    if (!error && self) self->Speak();
  });
}

}  // namespace baudgate::tools
