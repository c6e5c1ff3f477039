// The state table of `Line`. "next" contains the next state; if an outcome follows the state, as in
// "drain, corrupt", the exchange ends with this outcome. The times are those of LineTimes. "reply"
// and "ceiling" count from the computed end of the transmission. "ceiling" is the limit of the
// whole exchange. The same limit holds for quiet, counted from Start, and for drain, counted from
// its beginning. Stray bytes came while no reply was awaited. Bytes that are set aside are not read
// yet (see Transmission). Held bytes are read, but are no whole frame yet. An aftermath is a
// silence after a reply (see Exchange::aftermath).
//
// clang-format off
//   state        event                         next
//   closed       opened                        idle
//   idle         Start                         quiet; sending at once if the line was silent long enough
//   idle         bytes of an unasked message   receiving, until the message is whole, damaged or over its
//                (UnaskedReceiver)             time; then idle. No exchange begins meanwhile
//   any but      a whole unasked message       unchanged; the message goes to LineNews::unasked. It is the
//   closed                                     reply only if the request under way expects such a message
//   idle         bytes                         idle; stray, and the silence before a request begins again
//   idle, quiet, drain: stray bytes            unchanged; a second, different reply may be among the bytes
//   quiet        bytes                         quiet; its time begins again, but ends at the ceiling
//   quiet        timer                         sending
//   sending      bytes, on a pty or a network  sending; held: an echo, or an early reply
//   sending      bytes, on a port that keeps   sending; set aside. They are stray as soon as more bytes
//                its bit rate                  come after the end of the transmission
//   sending      whole frame, on a pty or a    as in receiving: the reply may come before the computed
//                network                       end of the transmission
//   sending      timer (end of transmission)   settle if no reply is expected; receiving if bytes are
//                                              held; else await_first
//   settle       bytes                         settle; stray, because no device was asked to answer
//   settle       timer                         idle, ok
//   await_first  bytes                         receiving
//   await_first  timer (reply)                 drain, unexpected if whole replies of other devices came,
//                                              else no_reply. Bytes that were set aside are tried first
//   receiving    two different whole frames    drain, unexpected
//   receiving    whole frame                   idle; drain if the frame is judged unexpected, if an
//                                              aftermath is due, or if more bytes follow the frame
//   receiving    timer (gap)                   the frame rule is asked once more, with idle = true. If
//                                              there is no frame: await_first if only noise or whole
//                                              replies of other devices came and the reply time is not
//                                              over; else drain with the worst outcome of the bytes
//   receiving    timer (ceiling)               drain, corrupt: the ceiling limits the whole exchange
//   sending, await_first, receiving:
//                the server ended the          drain, no_reply
//                connection
//                collision                     drain, corrupt; not before the end of the transmission
//   drain        bytes                         drain; its time begins again, but ends at the ceiling
//   drain        timer                         idle
//   quiet        closed                        closed; the exchange does not take place
//   any          closed                        closed; an exchange under way ends as line_down
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/line.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/base/time.h"

namespace baudgate::bus {

bool IsEmptyLine(View frame) { return std::ranges::all_of(frame, IsLineEnd); }

bool SecondReply::IsAlone(const Bytes& frame, const protocols::Assembler& assembler) {
  taken_.clear();
  behind_ = assembler;
  while (const auto second = behind_.Next(false)) {
    if (*second != frame && !IsEmptyLine(*second)) return false;
  }
  return true;
}

bool SecondReply::FoundIn(View bytes) {
  if (taken_.empty()) return false;
  behind_.Feed(bytes);
  while (const auto second = behind_.Next(false)) {
    if (*second == taken_ || IsEmptyLine(*second)) continue;
    taken_.clear();
    return true;
  }
  return false;
}

void UnaskedReceiver::Begin(Instant now) {
  assembler_.Begin(what_.rule, what_.expect);
  aligned_ = what_.marked;
  damaged_ = false;
  torn_until_ = {};
  last_byte_ = now;
}

std::optional<Instant> UnaskedReceiver::Deadline() const {
  if (!receiving()) return std::nullopt;
  return std::min(last_byte_ + what_.idle, TooLong());
}

Instant UnaskedReceiver::TooLong() const {
  return what_.whole > Duration::zero() ? began_ + what_.whole : Instant::max();
}

UnaskedInput UnaskedReceiver::Feed(View bytes, Instant now) {
  UnaskedInput heard = OnTimer(now);  // in case OnTimer is called late
  if (bytes.empty()) return heard;
  if (now - last_byte_ >= what_.idle) {
    Align(now);
    damaged_ = false;
  }
  if (!receiving()) began_ = now;
  last_byte_ = now;
  assembler_.Feed(bytes);
  Take(heard, false, now);
  return heard;
}

UnaskedInput UnaskedReceiver::OnTimer(Instant now) {
  UnaskedInput heard;
  if (const auto deadline = Deadline(); deadline && *deadline <= now) End(heard, now);
  return heard;
}

void UnaskedReceiver::Take(UnaskedInput& heard, bool idle, Instant now) {
  for (;;) {
    auto message = assembler_.Next(idle, &heard.rest);
    const std::string_view why = assembler_.why();
    if (NeedsDrain(assembler_.TakeBlame())) Damage(heard, why);
    if (!message) return;
    began_ = now;
    if (std::exchange(aligned_, true)) {
      damaged_ = false;
      heard.messages.push_back({std::move(*message), now - last_byte_});
    } else {
      Damage(heard, torn_until_ == Instant() ? "the port was opened in the middle of the message"
                                             : "the beginning of the message may be missing");
    }
  }
}

/// Called after a silence: the next byte begins a message, unless it may still belong to a broken
/// message (torn_until_).
void UnaskedReceiver::Align(Instant now) { aligned_ = now >= torn_until_; }

/// Counts a damaged message. Further damage counts as the same message until a whole message or a
/// silence comes.
void UnaskedReceiver::Damage(UnaskedInput& heard, std::string_view why) {
  if (std::exchange(damaged_, true)) return;
  ++heard.damaged;
  heard.why = why;
}

void UnaskedReceiver::End(UnaskedInput& heard, Instant now) {
  if (last_byte_ + what_.idle <= TooLong()) {
    const bool could_go_on = !what_.marked && what_.whole > Duration::zero();
    Take(heard, true, now);
    if (heard.damaged > 0 && could_go_on) torn_until_ = TooLong();
    Align(now);
    return;
  }
  Damage(heard, "the message lasts longer than any message of this device may last");
  assembler_.Begin(what_.rule, what_.expect);
  aligned_ = what_.marked;
}

namespace {

/// If bytes are read this long after a deadline, the program was stopped meanwhile, and it is
/// unknown when they arrived. The deadline is then handled before the bytes.
constexpr Duration kHeldUp = 100ms;

bool IsUnderWay(Line::State state) {
  return state == Line::State::sending || state == Line::State::settle ||
         state == Line::State::await_first || state == Line::State::receiving;
}

bool IsAwaited(Line::State state) { return IsUnderWay(state) && state != Line::State::settle; }

bool IsListening(Line::State state) {
  return state == Line::State::await_first || state == Line::State::receiving;
}

bool HasTimer(Line::State state) {
  return state != Line::State::closed && state != Line::State::idle;
}

/// True if the program was stopped past the deadline: see kHeldUp.
bool IsHeldUp(Instant deadline, Instant now) { return now >= deadline + kHeldUp; }

Duration SilenceAfter(Outcome outcome, const Exchange& exchange) {
  if (!NeedsDrain(outcome)) return exchange.aftermath;
  const Duration drain = exchange.times.drain;
  // A late reply that contains an address cannot be mistaken for the reply of another device.
  const bool named = !exchange.request.expect.address.empty();
  return outcome == Outcome::no_reply || named ? drain : std::max(drain, exchange.aftermath);
}

}  // namespace

void Line::OnOpened(Instant now, bool keeps_bit_rate) {
  transmission_.OnOpened(keeps_bit_rate);
  state_ = State::idle;
  last_activity_ = now;
  ended_ = now;
  second_ = {};
  second_before_ = {};
  if (unasked_) unasked_->Begin(now);
}

LineNews Line::OnClosed() {
  const State was = std::exchange(state_, State::closed);
  if (IsUnderWay(was)) news_.end = {Outcome::line_down, "the port was lost", {}, 0};
  if (unasked_) unasked_->Begin(last_activity_);
  return TakeNews();
}

std::optional<Instant> Line::Deadline() const {
  if (state_ == State::closed) return std::nullopt;
  const auto heard = unasked_ ? unasked_->Deadline() : std::nullopt;
  return HasTimer(state_) ? Soonest({deadline_, heard}) : heard;
}

LineNews Line::Start(Exchange exchange, Instant now) {
  exchange_ = std::move(exchange);
  assembler_.Begin(exchange_.reply_rule, exchange_.request.expect);
  state_ = State::quiet;
  deadline_ = last_activity_ + exchange_.times.quiet;
  limit_ = now + exchange_.times.ceiling;
  if (deadline_ <= now) BeginSending(now);
  return TakeNews();
}

void Line::Cancel() {
  if (state_ == State::quiet) state_ = State::idle;
}

LineNews Line::Feed(View bytes, Instant now) {
  if (bytes.empty()) return TakeNews();
  if (!unasked_ || state_ == State::closed) {
    TakeBytes(bytes, now);
  } else {
    if (IsListening(state_) && IsHeldUp(deadline_, now)) TakeTimer(now);
    last_activity_ = now;
    if (state_ == State::quiet) deadline_ = std::min(now + exchange_.times.quiet, limit_);
    if (state_ == State::receiving) deadline_ = std::min(now + exchange_.times.gap, limit_);
    Hear(unasked_->Feed(bytes, now), now);
  }
  return TakeNews();
}

LineNews Line::OnTimer(Instant now) {
  if (unasked_ && state_ != State::closed) Hear(unasked_->OnTimer(now), now);
  TakeTimer(now);
  return TakeNews();
}

/// Moves messages that came unasked to `news_`, and reads the remaining bytes as a possible reply.
/// A request to a pty or a network leaves at once, so its reply may come before the computed end of
/// the transmission.
void Line::Hear(UnaskedInput heard, Instant now) {
  // The transmission has ended, but its timer is late.
  if (state_ == State::sending && now >= transmission_.until()) EndSending(now);
  const bool early = state_ == State::sending && !transmission_.keeps_bit_rate();
  const bool awaited = exchange_.request.expect.reply == protocols::Expectation::Reply::standing &&
                       (early || IsListening(state_));
  if (awaited && !heard.messages.empty()) {
    Finish(client_.Judge(heard.messages.front().bytes, now), {}, now);
  }
  // In the state idle the remaining bytes come from the device that sends unasked, so they do not
  // count as stray bytes.
  if (!heard.rest.empty() && state_ != State::idle) TakeBytes(heard.rest, now);
  heard.rest.clear();
  news_.unasked = std::move(heard);
}

void Line::TakeBytes(View bytes, Instant now) {
  last_activity_ = now;
  switch (state_) {
    case State::closed:
      break;
    case State::idle:
      TakeStray(bytes, now);
      break;
    case State::quiet:
      TakeStray(bytes, now);
      deadline_ = std::min(now + exchange_.times.quiet, limit_);
      break;
    case State::drain:
      TakeStray(bytes, now);
      deadline_ = std::max(deadline_, std::min(now + exchange_.times.drain, limit_));
      break;
    case State::settle:
      TellStray(bytes.size(), now - ended_);
      break;
    case State::sending:
      if (now >= transmission_.until()) {  // OnTimer is called late
        EndSending(now);
        TakeBytes(bytes, now);
      } else if (!transmission_.Keeps(bytes) && assembler_.held() < Transmission::kMostKept) {
        assembler_.Feed(bytes);
        TakeAhead(now);
      }
      break;
    case State::await_first:
    case State::receiving:
      if (IsHeldUp(deadline_, now)) {
        TakeTimer(now);
        TakeBytes(bytes, now);
      } else {
        Receive(bytes, now);
      }
      break;
  }
}

LineNews Line::OnCollision(Instant now) {
  if (!IsAwaited(state_)) return {};
  Finish(Outcome::corrupt, "the echo differs from what was sent: a collision", now);
  deadline_ = std::max(deadline_, transmission_.until() + exchange_.times.drain);
  return TakeNews();
}

LineNews Line::OnEnded(Instant now) {
  if (IsAwaited(state_)) {
    Finish(Outcome::no_reply, "the server closed the connection instead of answering", now);
    news_.end->ended = true;
  }
  return TakeNews();
}

void Line::TakeTimer(Instant now) {
  if (!HasTimer(state_) || now < deadline_) return;
  switch (state_) {
    case State::closed:
    case State::idle:
      break;
    case State::quiet:
      BeginSending(now);
      break;
    case State::sending:
      EndSending(now);
      break;
    case State::settle:
      Finish(Outcome::ok, {}, now);
      break;
    case State::await_first:
      if (TakeEarly(now)) break;
      // Noise alone counts as silence. Whole replies of other devices make the outcome
      // `unexpected`.
      if (assembler_.blame() == Outcome::unexpected) {
        Finish(Outcome::unexpected, std::string(assembler_.why()), now);
      } else {
        Finish(Outcome::no_reply, {}, now);
      }
      break;
    case State::receiving:
      OnGap(now);
      break;
    case State::drain:
      state_ = State::idle;
      break;
  }
}

void Line::BeginSending(Instant now) {
  state_ = State::sending;
  second_before_ = std::exchange(second_, {});
  transmission_.Begin(now, TransmissionTime(exchange_.request, exchange_.times.character));
  deadline_ = transmission_.until();
  last_activity_ = transmission_.until();
  news_.send = true;
}

void Line::EndSending(Instant now) {
  if (exchange_.request.expect.reply == protocols::Expectation::Reply::none) {
    state_ = State::settle;
    deadline_ = now + std::max(exchange_.times.quiet, exchange_.times.settle);
    return;
  }
  state_ = State::await_first;
  deadline_ = transmission_.until() + exchange_.times.reply;
  limit_ = transmission_.until() + exchange_.times.ceiling;
  if (assembler_.fed() > 0) Receive({}, now);
}

void Line::Receive(View bytes, Instant now) {
  DropEarly();
  assembler_.Feed(bytes);
  state_ = State::receiving;
  deadline_ = std::min(now + exchange_.times.gap, limit_);
  TakeFrame(false, now);
}

void Line::TakeFrame(bool idle, Instant now) {
  const auto frame = assembler_.Next(idle);
  if (!frame) return;
  const std::size_t behind = assembler_.held();
  if (!second_.IsAlone(*frame, assembler_)) {
    Finish(Outcome::unexpected, "two different replies to one request came together", now);
    news_.stray.second_reply = true;
  } else {
    // The exchange is still under way here, so the client cannot start another exchange from Judge.
    const Outcome outcome = client_.Judge(*frame, now);
    if (!NeedsDrain(outcome)) second_.Take(*frame);
    Finish(outcome, {}, now);
  }
  if (behind == 0) return;
  TellStray(behind, Duration::zero());
  const protocols::Request& request = exchange_.request;
  const bool harmless = (request.any_order || request.numbered) && second_.only_copies();
  if (state_ == State::idle && !harmless) Drain(exchange_.times.drain, now);
}

void Line::TellStray(std::size_t count, Duration since_end) {
  StrayBytes& stray = IsUnderWay(state_) ? news_.stray_before : news_.stray;
  stray.count += count;
  stray.since_end = since_end;
}

void Line::TakeStray(View bytes, Instant now) {
  TellStray(bytes.size(), now - ended_);
  if (second_.FoundIn(bytes)) news_.stray.second_reply = true;
}

/// Reads the bytes that came during the transmission as the reply, because no other bytes have
/// come. If they are the reply, this port does not keep its bit rate.
bool Line::TakeEarly(Instant now) {
  // A reply that equals its request (`mirrors`) could be an echo. If the program was stopped, it is
  // unknown when the bytes came.
  const bool held_up = IsHeldUp(deadline_, now);
  if (!transmission_.has_early() || held_up || exchange_.request.expect.mirrors) return false;
  assembler_.Feed(transmission_.TakeEarly());
  state_ = State::receiving;
  TakeFrame(true, now);
  if (state_ == State::receiving) return false;
  transmission_.OnEarlyReply();
  return true;
}

/// On a pty or a network, takes a whole reply that came before the computed end of its request. A
/// reply that could be an echo (`mirrors`) is read only after this end.
void Line::TakeAhead(Instant now) {
  const protocols::Expectation& expect = exchange_.request.expect;
  if (expect.reply != protocols::Expectation::Reply::one || expect.mirrors) return;
  TakeFrame(false, now);
  if (state_ != State::drain) return;
  const bool bad = NeedsDrain(news_.end->outcome);
  const Duration silence = bad ? exchange_.times.drain : exchange_.aftermath;
  deadline_ = std::max(deadline_, transmission_.until() + silence);
}

void Line::DropEarly() {
  if (!transmission_.has_early()) return;
  const Bytes early = transmission_.TakeEarly();
  TellStray(early.size(), transmission_.from() - ended_);
  if (second_before_.FoundIn(early)) news_.stray_before.second_reply = true;
}

void Line::OnGap(Instant now) {
  if (now >= limit_) {
    Finish(Outcome::corrupt, "the device kept sending for longer than an exchange may last", now);
    return;
  }
  TakeFrame(true, now);
  if (state_ != State::receiving) return;
  // After noise and replies of other devices the awaited reply may still come.
  const Outcome blame = assembler_.blame();
  const bool harmless = blame == Outcome::none || (blame == Outcome::unexpected && !exchange_.lags);
  const Instant due = transmission_.until() + exchange_.times.reply;
  if (harmless && now < due) {
    state_ = State::await_first;
    deadline_ = due;
  } else if (blame == Outcome::none) {
    Finish(Outcome::no_reply, {}, now);
  } else {
    Finish(blame, std::string(assembler_.why()), now);
  }
}

void Line::Finish(Outcome outcome, std::string reason, Instant now) {
  const bool answered =
      state_ != State::settle && (!NeedsDrain(outcome) || outcome == Outcome::unexpected);
  ended_ = now;
  const Duration silence = SilenceAfter(outcome, exchange_);
  if (NeedsDrain(outcome) || silence > Duration::zero()) {
    Drain(silence, now);
  } else {
    state_ = State::idle;
  }
  news_.end = {outcome, std::move(reason), {}, assembler_.fed()};
  if (!answered) return;
  news_.end->round_trip = last_activity_ - transmission_.from();
  news_.end->since_reply = now - last_activity_;
}

void Line::Drain(Duration silence, Instant now) {
  state_ = State::drain;
  deadline_ = now + silence;
  limit_ = now + std::max(exchange_.times.ceiling, silence);
}

void EchoFilter::OnSent(View request) {
  if (!differs_) Append(expected_, request);
}

EchoResult EchoFilter::Filter(View received) {
  EchoResult result;
  std::size_t used = 0;
  if (!differs_) {
    const bool was_pending = matched_ < expected_.size();
    while (used < received.size() && matched_ < expected_.size() &&
           received[used] == expected_[matched_]) {
      ++used;
      ++matched_;
    }
    result.complete = was_pending && matched_ == expected_.size();
    if (used < received.size() && matched_ < expected_.size()) {
      differs_ = true;
      if (!passes()) Append(result.bytes, View(expected_).first(matched_));
      matched_ = 0;
      result.collision = mode_ == config::Echo::verify;
    }
  }
  Append(result.bytes, passes() ? received : received.subspan(used));
  return result;
}

EchoResult EchoFilter::OnExchangeEnd() {
  EchoResult result;
  if (!differs_ && matched_ < expected_.size()) {
    if (!passes()) Append(result.bytes, View(expected_).first(matched_));
    result.collision = mode_ == config::Echo::verify;
  }
  expected_.clear();
  matched_ = 0;
  differs_ = false;
  return result;
}

void EchoWatch::OnSent(View request) {
  filter_.OnSent(request);
  echoed_ = false;
}

EchoWatch::Received EchoWatch::OnReceived(View bytes, const protocols::Request* asked) {
  EchoResult result = filter_.Filter(bytes);
  Received heard;
  heard.bytes = std::move(result.bytes);
  if (mode_ == config::Echo::off) {
    // If a good reply equals its request (`mirrors`), the bytes may be the reply and no echo.
    heard.echo = result.complete && asked != nullptr && !asked->expect.mirrors;
    if (!heard.echo) return heard;
    echoes_ = echoed_ = true;
    if (!std::exchange(told_echo_, true)) {
      heard.warning =
          "the request itself came back: this bus or its adapter echoes; set 'echo: strip' at the "
          "line";
    }
    return heard;
  }
  if (result.complete && mode_ == config::Echo::verify) {
    has_echoed_ = true;
    unechoed_ = 0;
  }
  heard.collision = result.collision;
  if (heard.collision && asked != nullptr && !std::exchange(told_collision_, true)) {
    heard.warning =
        "the echo is missing or differs from what was sent: two masters send at once, or the bus "
        "does not echo (then set 'echo: off' at the line)";
  }
  return heard;
}

bool EchoWatch::MayBeEcho(const protocols::Request& request, View frame) const {
  return echoes_ && request.expect.mirrors && std::ranges::equal(frame, request.bytes);
}

bool EchoWatch::OnExchangeEnd(const protocols::Request& request, ExchangeEnd& end) {
  const EchoResult rest = filter_.OnExchangeEnd();
  if (ProvesLife(end.outcome) && !request.expect.mirrors) {
    free_ = !echoed_;
    if (free_) echoes_ = false;
  }
  const bool asked = request.expect.reply == protocols::Expectation::Reply::one;
  if (!rest.collision || !asked || end.outcome == Outcome::line_down) return false;
  unechoed_ = rest.bytes.empty() ? unechoed_ + 1 : 0;
  end.reason = rest.bytes.empty() ? "no reply, and not even the echo of the request"
                                  : "the echo of the request broke off";
  return true;
}

}  // namespace baudgate::bus
