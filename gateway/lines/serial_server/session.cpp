// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/session.h"

#include <utility>

namespace baudgate::serial_server {
namespace {

using config::Parity;

// Numbers of a client's commands (RFC 2217). The answer has the number of the command plus kAnswer.
constexpr std::uint8_t kSignature = 0;
constexpr std::uint8_t kSetBaud = 1;
constexpr std::uint8_t kSetData = 2;
constexpr std::uint8_t kSetParity = 3;
constexpr std::uint8_t kSetStop = 4;
constexpr std::uint8_t kSetControl = 5;
constexpr std::uint8_t kNotifyLine = 6;
constexpr std::uint8_t kNotifyModem = 7;
constexpr std::uint8_t kSuspend = 8;
constexpr std::uint8_t kResume = 9;
constexpr std::uint8_t kLineMask = 10;
constexpr std::uint8_t kModemMask = 11;
constexpr std::uint8_t kPurge = 12;
constexpr std::uint8_t kAnswer = 100;

// Values of SET-CONTROL (RFC 2217). A kAsk… value asks for a state, and the next higher values set
// it, for example 8 sets DTR on. Values kDcdFlow to kDsrFlow are not supported.
constexpr std::uint8_t kAskFlow = 0, kAskBreak = 4, kAskDtr = 7, kAskRts = 10, kAskInbound = 13;
constexpr std::uint8_t kDcdFlow = 17, kDsrFlow = 19;

// The first line contains bits of the modem state, the other lines bits of the line state (RFC
// 2217). In the modem state, the bit for a change of a signal is four bits below the bit for its
// level.
constexpr std::uint8_t kCts = 0x10, kDsr = 0x20, kRing = 0x40, kDcd = 0x80;
constexpr std::uint8_t kOverrun = 0x02, kParityError = 0x04, kFramingError = 0x08, kBreak = 0x10;
constexpr std::uint8_t kHoldingEmpty = 0x20, kShiftEmpty = 0x40;

/// The parity numbers of RFC 2217: 1 none, 2 odd, 3 even, 4 mark, 5 space.
constexpr Parity kParities[] = {Parity::none, Parity::odd, Parity::even, Parity::mark,
                                Parity::space};

Bytes Answer(std::uint8_t command, View value) {
  Bytes bytes = {static_cast<std::uint8_t>(command + kAnswer)};
  Append(bytes, value);
  return Subnegotiation(telnet::kComPort, bytes);
}

Bytes Answer(std::uint8_t command, std::uint8_t value) { return Answer(command, View(&value, 1)); }

}  // namespace

ComPort::ComPort(transports::Transport& port, const config::SerialSettings& serial,
                 std::string signature)
    : port_(port),
      serial_(serial),
      software_(serial.software_parity),
      signature_(std::move(signature)),
      counters_(port.Counters()) {}

Bytes ComPort::On(View command) {
  if (command.empty()) return {};
  const std::uint8_t what = command.front();
  const View value = command.subspan(1);
  Bytes answer;
  if (what == kSignature) {
    // A command with a text contains the signature of the client and needs no answer.
    if (value.empty()) {
      answer = Answer(kSignature, View(reinterpret_cast<const std::uint8_t*>(signature_.data()),
                                       signature_.size()));
    }
  } else if (what == kSetBaud) {
    answer = SetBaud(value);
  } else if (what == kNotifyLine) {
    answer = Answer(kNotifyLine, LineState());
  } else if (what == kNotifyModem) {
    answer = NotifyModem(ModemState());
  } else if (what == kSuspend || what == kResume) {
    suspended_ = what == kSuspend;
  } else if (!value.empty()) {
    answer = SetOne(what, value.front());
  }
  if (!std::exchange(greeted_, true)) Append(answer, View(NotifyModem(ModemState())));
  return answer;
}

Bytes ComPort::SetOne(std::uint8_t command, std::uint8_t value) {
  config::SerialSettings wanted = serial_;
  switch (command) {
    case kSetData:
      if (value >= 5 && value <= 8) wanted.data_bits = value;
      Try(wanted);
      return Answer(command, static_cast<std::uint8_t>(serial_.data_bits));
    case kSetParity:
      if (value >= 1 && value <= std::size(kParities)) wanted.parity = kParities[value - 1];
      Try(wanted);
      return Answer(command, ParityCode());
    case kSetStop:
      // Value 3 is 1.5 stop bits: with five data bits, a UART makes them by its setting for two.
      if (value == 1 || value == 2 || (value == 3 && wanted.data_bits == 5)) {
        wanted.stop_bits = value == 1 ? 1 : 2;
      }
      Try(wanted);
      return Answer(command, StopCode());
    case kSetControl:
      return SetControl(value);
    case kLineMask:
      line_mask_ = value;
      return Answer(command, value);
    case kModemMask:
      modem_mask_ = value;
      return Answer(command, value);
    case kPurge:
      return Purge(value);
    default:
      return {};
  }
}

Bytes ComPort::SetBaud(View value) {
  const auto baud = ByteReader(value).U32Be(0);
  if (!baud) return {};
  config::SerialSettings wanted = serial_;
  // No port is as fast, so higher rates are ignored. The driver refuses rates that it cannot set.
  constexpr std::uint32_t kMost = 100'000'000;
  if (*baud > 0 && *baud < kMost) wanted.baud = static_cast<int>(*baud);
  Try(wanted);
  const auto now = static_cast<std::uint32_t>(serial_.baud);
  const Bytes bytes = {static_cast<std::uint8_t>(now >> 24), static_cast<std::uint8_t>(now >> 16),
                       static_cast<std::uint8_t>(now >> 8), static_cast<std::uint8_t>(now)};
  return Answer(kSetBaud, bytes);
}

void ComPort::Try(const config::SerialSettings& wanted) {
  config::SerialSettings next = wanted;
  const bool even_or_odd = next.parity == Parity::even || next.parity == Parity::odd;
  next.software_parity = software_ && next.data_bits == 7 && even_or_odd;
  if (config::Same(next, serial_)) return;
  if (port_.Apply(next)) {
    serial_ = next;
  } else {
    (void)port_.Apply(serial_);  // the driver may have set a part of `next`
  }
}

std::uint8_t ComPort::ParityCode() const {
  std::uint8_t code = 1;
  for (const Parity parity : kParities) {
    if (parity == serial_.parity) break;
    ++code;
  }
  return code;
}

std::uint8_t ComPort::StopCode() const {
  if (serial_.stop_bits == 1) return 1;
  return serial_.data_bits == 5 ? 3 : 2;
}

/// Handles a SET-CONTROL value for flow control: `ask` asks for the state, `ask` + 1 sets none, + 2
/// XON/XOFF, + 3 hardware. A port has one flow control for both directions.
std::uint8_t ComPort::Flow(std::uint8_t ask, std::uint8_t value) {
  if (value != ask) {
    config::SerialSettings wanted = serial_;
    wanted.xonxoff = value == ask + 2;
    wanted.rtscts = value == ask + 3;
    Try(wanted);
  }
  return static_cast<std::uint8_t>(ask + (serial_.rtscts ? 3 : serial_.xonxoff ? 2 : 1));
}

/// Handles a SET-CONTROL value for a signal: `ask` asks for the state, `ask` + 1 sets on, + 2 off.
std::uint8_t ComPort::Switch(transports::PortSwitch which, bool& state, std::uint8_t ask,
                             std::uint8_t value) {
  const bool on = value == ask + 1;
  if (value != ask && port_.Set(which, on)) state = on;
  return static_cast<std::uint8_t>(ask + (state ? 1 : 2));
}

bool ComPort::Break(bool on) {
  return port_.Set(transports::PortSwitch::break_signal, on || break_).ok();
}

Bytes ComPort::SetControl(std::uint8_t value) {
  std::uint8_t answer = 0;
  if (value < kAskBreak) {
    answer = Flow(kAskFlow, value);
  } else if (value < kAskDtr) {
    answer = Switch(transports::PortSwitch::break_signal, break_, kAskBreak, value);
  } else if (value < kAskRts) {
    answer = Switch(transports::PortSwitch::dtr, dtr_, kAskDtr, value);
  } else if (value < kAskInbound) {
    answer = Switch(transports::PortSwitch::rts, rts_, kAskRts, value);
  } else if (value < kDcdFlow) {
    answer = Flow(kAskInbound, value);
  } else if (value <= kDsrFlow) {
    // Flow control by DCD, DTR or DSR is not supported: the answer is the current flow control.
    answer = Flow(kAskFlow, kAskFlow);
  } else {
    return {};
  }
  return Answer(kSetControl, answer);
}

Bytes ComPort::Purge(std::uint8_t what) {
  if (what < 1 || what > 3) return {};
  port_.Purge((what & 1) != 0, (what & 2) != 0);
  return Answer(kPurge, what);
}

Bytes ComPort::NotifyModem(std::uint8_t state) const { return Answer(kNotifyModem, state); }

/// Returns the levels in the upper four bits, and changes since the last call in the lower four.
std::uint8_t ComPort::ModemState() {
  const ModemLines lines = port_.ReadModemLines().value_or(ModemLines{});
  const unsigned now = (lines.cts ? kCts : 0U) | (lines.dsr ? kDsr : 0U) |
                       (lines.ring ? kRing : 0U) | (lines.dcd ? kDcd : 0U);
  const unsigned changed = now ^ std::exchange(modem_, static_cast<std::uint8_t>(now));
  // RFC 2217 counts only the end of a ring as a change.
  const unsigned deltas = (changed & ~(now & kRing)) >> 4U;
  return static_cast<std::uint8_t>(now | deltas);
}

std::uint8_t ComPort::LineState() {
  const transports::PortCounters now = port_.Counters();
  const transports::PortCounters before = std::exchange(counters_, now);
  unsigned state = port_.IsDrained() ? kHoldingEmpty | kShiftEmpty : 0U;
  if (now.overrun != before.overrun) state |= kOverrun;
  if (now.parity != before.parity) state |= kParityError;
  if (now.framing != before.framing) state |= kFramingError;
  if (now.breaks != before.breaks) state |= kBreak;
  return static_cast<std::uint8_t>(state);
}

Bytes ComPort::Poll() {
  Bytes news;
  if (!greeted_) return news;
  const unsigned before = modem_;
  const std::uint8_t modem = ModemState();
  const unsigned changed = (before ^ modem_) | (modem & 0x0FU);
  if ((changed & modem_mask_) != 0) news = NotifyModem(modem);
  if (line_mask_ == 0) return news;
  constexpr unsigned kErrors = kOverrun | kParityError | kFramingError | kBreak;
  const std::uint8_t line = LineState();
  if ((line & line_mask_ & kErrors) != 0) {
    Append(news, View(Answer(kNotifyLine, static_cast<std::uint8_t>(line & line_mask_))));
  }
  return news;
}

Session::Session(Visit visit, Duration idle, std::string signature, Connection& connection)
    : visit_(std::move(visit)),
      idle_(idle),
      signature_(std::move(signature)),
      connection_(connection),
      heard_(visit_.began.instant) {
  if (is_telnet()) connection_.Send(telnet_.Begin());
}

void Session::OnClient(View bytes, Now now) {
  heard_ = now.instant;
  if (is_telnet()) {
    Decode(bytes, now);
  } else {
    Take(Kind::data, bytes, now);
  }
  Regulate();
}

void Session::Decode(View bytes, Now now) {
  for (;;) {
    Bytes answers;
    const auto part = telnet_.Next(bytes, answers);
    if (!answers.empty()) connection_.Send(answers);
    if (!part) return;
    Take(part->kind, part->bytes, now);
  }
}

void Session::Take(Kind kind, View bytes, Now now) {
  asks_ = true;
  if (port_ == nullptr || break_at_) {
    waiting_.push_back({kind, Bytes(bytes.begin(), bytes.end())});
  } else if (kind == Kind::break_key) {
    break_asked_ = now.instant;
    LookAtBreak(now);
  } else if (kind == Kind::command) {
    if (const Bytes answer = com_->On(bytes); !answer.empty()) connection_.Send(answer);
  } else {
    visit_.to_port += bytes.size();
    port_->Send(bytes);
  }
}

/// Handles what the client has sent during a break or before Begin, up to the next break.
void Session::TakeWaiting(Now now) {
  while (!waiting_.empty() && !break_at_) {
    const Waiting one = std::move(waiting_.front());
    waiting_.pop_front();
    Take(one.kind, one.bytes, now);
  }
}

/// Begins or ends a break when it is due. A port that cannot make a break, such as a pty, causes no
/// delay.
void Session::LookAtBreak(Now now) {
  if (std::exchange(breaks_, false)) {
    (void)com_->Break(false);
    break_at_.reset();
  } else if (!port_->IsDrained() && now.instant - break_asked_ < kMostBeforeBreak) {
    break_at_ = now.instant + kLookBeforeBreak;
  } else {
    breaks_ = com_->Break(true);
    break_at_ = breaks_ ? std::optional(now.instant + kBreakLasts) : std::nullopt;
  }
}

void Session::OnClientEnd(Now now) {
  if (drain_.has_begun()) return;
  drain_.Begin(now.instant);
  OnTimer(now);
}

void Session::Begin(transports::Transport& port, const config::SerialSettings& serial, Now now) {
  port_ = &port;
  visit_.began = now;
  heard_ = now.instant;
  if (is_telnet()) {
    com_.emplace(port, serial, signature_);
    look_at_ = now.instant + kLookEvery;
  }
  TakeWaiting(now);
  Regulate();
}

void Session::OnPort(View bytes, Now now) {
  heard_ = now.instant;
  visit_.from_port += bytes.size();
  if (is_telnet()) {
    Bytes escaped;
    escaped.reserve(bytes.size());
    AppendEscaped(escaped, bytes);
    connection_.Send(escaped);
  } else {
    connection_.Send(bytes);
  }
  Regulate();
}

void Session::End() {
  port_ = nullptr;
  com_.reset();
  look_at_.reset();
  break_at_.reset();
  breaks_ = false;
}

/// Stops reading from the client while the port takes no bytes, from both if the client takes none.
void Session::Regulate() {
  const bool answers_wait = connection_.unsent() > kMostForClient;
  const bool pause_client =
      answers_wait || (port_ == nullptr ? asks_ : break_at_ || port_->Unsent() > kMostForPort);
  if (client_paused_ != pause_client) connection_.Pause(client_paused_ = pause_client);
  if (port_ == nullptr) return;
  const bool pause_port = answers_wait || (com_ && com_->suspended());
  if (port_paused_ != pause_port) port_->Pause(port_paused_ = pause_port);
}

void Session::OnTimer(Now now) {
  if (HasCome(break_at_, now.instant)) {
    LookAtBreak(now);
    TakeWaiting(now);
    Regulate();
  }
  if (HasCome(drain_.Deadline(), now.instant)) {
    const bool drained = waiting_.empty() && !break_at_ && (port_ == nullptr || port_->IsDrained());
    if (const auto why = drain_.Look(drained, now.instant)) over_ = why;
  }
  if (HasCome(look_at_, now.instant)) {
    look_at_ = now.instant + kLookEvery;
    if (const Bytes news = com_->Poll(); !news.empty()) connection_.Send(news);
  }
  if (!over_ && now.instant - heard_ >= idle_) {
    over_ = "no bytes passed for " + FormatDuration(idle_);
  }
}

std::optional<Instant> Session::Deadline() const {
  return Soonest({heard_ + idle_, look_at_, break_at_, drain_.Deadline()});
}

}  // namespace baudgate::serial_server
