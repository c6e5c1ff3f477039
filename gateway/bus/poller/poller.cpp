// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/poller.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

namespace {

/// A device that goes on for longer is not listened to.
constexpr std::size_t kMostReply = 8192;

}  // namespace

TelegramExchange::TelegramExchange(const Speaking& as, config::Echo echo, View telegram,
                                   Instant now)
    : echo_(echo), as_(as) {
  request_.bytes.assign(telegram.begin(), telegram.end());
  request_.expect = as.protocol->expect(telegram, as.options);
  line_.OnOpened(now);
}

bool TelegramExchange::Begin(Instant now) {
  Exchange exchange;
  exchange.request = request_;
  exchange.reply_rule = as_.protocol->reply_rule;
  exchange.times = as_.times;
  return Take(line_.Start(std::move(exchange), now));
}

bool TelegramExchange::Receive(View bytes, Instant now) {
  const EchoResult heard = echo_.Filter(bytes);
  if (heard.bytes.empty()) return false;
  if (reply_.size() < kMostReply) Append(reply_, View(heard.bytes));
  return Take(line_.Feed(heard.bytes, now));
}

bool TelegramExchange::OnTimer(Instant now) { return Take(line_.OnTimer(now)); }

bool TelegramExchange::Take(LineNews news) {
  if (news.send) echo_.OnSent(request_.bytes);
  if (news.end) end_ = std::move(news.end);
  return news.send;
}

DeviceSide::DeviceSide(Roster& roster, Accounts& accounts, DeviceTracker& tracker,
                       UnaskedSide& unasked, EffectApplier& effects)
    : roster_(roster),
      accounts_(accounts),
      tracker_(tracker),
      unasked_(unasked),
      effects_(effects) {}

void DeviceSide::Attach(Tap& tap, std::vector<protocols::ForeignRule> foreign) {
  roster_.SetForeign(std::move(foreign));
  accounts_.Attach(tap);
}

void DeviceSide::OnOpened(Instant now) {
  tracker_.OnOpened(now);
  unasked_.OnOpened();
}

std::string DeviceSide::OnClosing(Override why) {
  accounts_.OnClosed(why);
  return WhyClosed();
}

void DeviceSide::Recall(std::uint32_t index, std::string memory, Now now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->Recall(memory, now);
  device.memory = std::move(memory);
  tracker_.OnRecalled(device);
}

void DeviceSide::SetInUse(std::uint32_t index, bool in_use, bool open, Instant now) {
  Device& device = roster_.DeviceAt(index);
  if (in_use) tracker_.OnEnabled(device, open, now);
  if (device.in_use != in_use) tracker_.SetInUse(device, in_use, open, now);
}

void DeviceSide::OnEventsKept(std::uint32_t index, const std::string& said, Instant now) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnEventsKept(said);
  unasked_.OnKept(device);
  effects_.OnEventsKept(device, said, now);
}

void DeviceSide::OnHostClock(bool right) {
  for (const auto& device : roster_.devices()) device->conversation->OnHostClock(right);
}

void DeviceSide::OnUnsettledWrite(std::uint32_t index) {
  Device& device = roster_.DeviceAt(index);
  device.conversation->OnUnsettledWrite();
  accounts_.states.OnMemory(device);
}

void DeviceSide::OnWritingTelegram(std::uint32_t index, View telegram, Instant now) {
  tracker_.OnTelegram(*roster_.DeviceAt(index).protocol, telegram, now);
}

Speaking DeviceSide::SpeakingAs(std::uint32_t index) const {
  const Device& device = roster_.DeviceAt(index);
  return {device.protocol, device.options, device.serial, device.times};
}

void Reception::OnOpened() {
  judge_.OnOpened();
  echo_.OnOpened();
  observer_.OnOpened();
}

void Reception::OnSend(const Job& job, Instant now) {
  observer_.OnRequest(*job.member, job.step.request, now);
  echo_.OnSent(job.step.request.bytes);
}

EchoWatch::Received Reception::TakeOutEcho(View bytes, const Job* job, Instant now) {
  EchoWatch::Received heard =
      echo_.OnReceived(bytes, job != nullptr ? &job->step.request : nullptr);
  if (!heard.bytes.empty()) observer_.Hear(heard.bytes, now);
  return heard;
}

Outcome Reception::Judge(Job& job, View frame, Instant now) {
  observer_.OnReply(frame);
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.step.request, frame), now);
}

Reception::Seen Reception::Assess(const Job& job, ExchangeEnd& end) {
  Seen seen;
  seen.no_echo = echo_.OnExchangeEnd(job.step.request, end);
  seen.cut = echo_.is_cut();
  seen.finding = observer_.TakeFinding(end.outcome);
  seen.negotiates = observer_.TakeNegotiation();
  judge_.CompleteFinding(job, end, echo_.echoed(), seen.finding);
  return seen;
}

LineSide::LineSide(Reception& reception, const protocols::Standing* standing, JobRun& run,
                   RequestPort& port)
    : reception_(reception), run_(run), port_(port) {
  if (standing != nullptr) line_.Listen(*standing);
}

// ---------------------------------------------------------------- inputs

void LineSide::OnOpened(Now now, bool keeps_bit_rate) {
  reception_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
}

void LineSide::OnPortClosed(const std::string& reason) {
  reception_.OnClosed();
  run_.OnClosed(reason);
}

LineSide::Received LineSide::FeedLine(View bytes, Instant now) {
  const Job* const job = run_.job();
  Received received{.member = job != nullptr ? job->member : nullptr,
                    .heard = reception_.TakeOutEcho(bytes, job, now),
                    .collided = {},
                    .news = {}};
  if (received.heard.collision) received.collided = line_.OnCollision(now);
  if (!received.heard.bytes.empty()) received.news = line_.Feed(received.heard.bytes, now);
  return received;
}

LineNews LineSide::OnTimer(Instant now) {
  Withdraw();  // the program may have been stopped since the line began to wait for its quiet
  return line_.OnTimer(now);
}

std::optional<Instant> LineSide::Deadline() const {
  const Job* const job = run_.job();
  const bool may_be_withdrawn = waits_for_quiet() && job != nullptr;
  return Soonest({line_.Deadline(), may_be_withdrawn ? LatestStart(*job) : std::nullopt});
}

Outcome LineSide::Judge(View frame, Instant now) {
  return reception_.Judge(*run_.job(), frame, now);
}

// ---------------------------------------------------------------- the request of the job

LineNews LineSide::Start(Instant idle_since, Instant now) {
  return line_.Start(run_.Start(idle_since), now);
}

void LineSide::Send(Now now) {
  const protocols::Request& request = run_.Send();
  reception_.OnSend(*run_.job(), now.instant);
  port_.Send(request.bytes, run_.job()->member->serial, now);
}

void LineSide::Withdraw() {
  if (waits_for_quiet() && run_.Withdraw()) line_.Cancel();
}

// ---------------------------------------------------------------- the end of its exchange

void LineSide::KeepEnd(ExchangeEnd end) {
  if (run_.job() != nullptr) run_.KeepEnd(std::move(end));
}

std::optional<LineSide::Over> LineSide::TakeEnd() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return std::nullopt;
  const Job& job = *run_.job();
  Over over{.member = job.member, .end = std::move(*end), .seen = {}};
  over.seen = reception_.Assess(job, over.end);
  return over;
}

void LineSide::PassToJob(Over over) {
  if (!ProvesLife(over.end.outcome)) {
    const bool closed = over.end.outcome == Outcome::line_down;
    if (port_.IsUnsent()) {
      run_.NeverLeft();
      if (!closed) over.end.reason = kNotConnected;
    }
    if (!closed) port_.DropUnsent();
  }
  run_.FollowUp(std::move(over.end), over.seen.finding);
}

void LineInputs::OnTime(Now now) {
  arrival_.OnInput(now.instant, IsAwaiting());
  accounts_.OnTime(now, !line_.idle(), line_.member(), !line_.asks());
}

std::optional<Instant> LineInputs::Deadline() const {
  return Soonest(
      {line_.Deadline(), IsAwaiting() ? std::optional(arrival_.NextLook()) : std::nullopt});
}

void LineInputs::OnClosed(const std::string& reason, Now now) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Apply(std::move(news), now);
  HandleEnd();
  line_.OnPortClosed(reason);
}

void LineInputs::HandleBytes(View bytes, Now now) {
  LineSide::Received received = line_.FeedLine(bytes, now.instant);
  const EchoWatch::Received& heard = received.heard;
  accounts_.line.OnHeard(heard, received.member);
  Apply(std::move(received.collided), now);
  if (heard.bytes.empty()) return;
  unasked_.Overhear(heard.bytes, now.instant);
  Apply(std::move(received.news), now);
}

/// A reply and a message are as old as they may be. No reply is older than its request.
void LineInputs::Date(LineNews& news, Instant now) const {
  for (UnaskedMessage& message : news.unasked.messages) {
    message.since = now - arrival_.Earliest(now - message.since);
  }
  if (!news.end) return;
  const Instant read = now - news.end->since_reply;
  news.end->since_reply = now - std::max(arrival_.Earliest(read), read - news.end->round_trip);
}

/// Applies the news of one input, in their order; HandleEnd applies the end of an exchange.
void LineInputs::Apply(LineNews news, Now now) {
  Date(news, now.instant);
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) HandleStray(news.stray_before, now.instant);
  if (news.end) line_.KeepEnd(std::move(*news.end));
  if (news.stray.count > 0) HandleStray(news.stray, now.instant);
  if (news.second_reply) tracker_.OnSecondReply(now.instant);
}

void LineInputs::Send(Now now) {
  for (const EarlierFinding& changed : line_.TakeChanged()) {
    accounts_.devices.OnMore(*changed.member, changed.finding, changed.back);
    // The line's patience with this device does not grow: its neighbours would pay for it.
    if (changed.lateness > Duration::zero()) {
      tracker_.CountLate(*changed.member, changed.lateness, now.instant);
    }
  }
  line_.Send(now);
}

void LineInputs::HandleStray(const StrayBytes& stray, Instant now) {
  const LateReplies::StrayEffects effects = tracker_.ApplyStray(stray, now);
  if (effects.warned != nullptr) accounts_.line.Warn(*effects.warned, effects.warning);
}

void LineInputs::HandleEnd() {
  std::optional<LineSide::Over> over = line_.TakeEnd();
  if (!over) return;
  if (over->seen.no_echo) accounts_.line.OnNoEcho();
  accounts_.line.OnRing(*over->member, over->seen.cut);
  if (over->seen.negotiates) accounts_.line.OnNegotiation();
  line_.PassToJob(std::move(*over));
}

Poller::Poller(const config::Line& line, std::uint32_t first_device, const FindProtocol& find,
               PointStore& store, RequestPort& port, PollerListener& listener,
               const MakeObserver& observe)
    : context_(line, first_device, find, store, listener),
      observer_(observe ? observe(context_.roster) : std::make_unique<LineObserver>()),
      intake_parts_(context_, *observer_, store, listener),
      chooser_(context_.roster, context_.agenda, context_.owed.late_replies),
      phases_(context_, chooser_, intake_parts_.replies),
      run_(phases_),
      reception_(line.echo, *observer_, context_.owed.whose),
      line_side_(reception_, intake_parts_.unasked.standing(), run_, port),
      devices_(context_.roster, context_.accounts, context_.tracker, intake_parts_.unasked,
               intake_parts_.replies),
      clients_(store, context_.roster, chooser_, context_.owed.whose, context_.agenda,
               context_.accounts.devices),
      turn_taker_(chooser_, run_, context_.accounts.line),
      line_(line_side_, intake_parts_.unasked, context_.tracker, context_.accounts) {}

// ---------------------------------------------------------------- inputs

void Poller::Advance(Now now) {
  const bool idle = line_.idle();
  const Duration passed = time_.OnInput(now, idle);
  line_.OnTime(now);
  turn_taker_.OnTime(now, passed, idle);
}

void Poller::Recall(std::uint32_t index, std::string memory, Now now) {
  Advance(now);
  devices_.Recall(index, std::move(memory), now);
}

void Poller::OnOpened(Now now, bool keeps_bit_rate) {
  if (line_.is_open()) OnClosed(now);
  Advance(now);
  turn_taker_.OnOpened();
  time_.Restart();
  line_.OnOpened(now, keeps_bit_rate);
  devices_.OnOpened(now.instant);
  TakeTurns();
}

void Poller::OnClosed(Now now, Override why) {
  Advance(now);
  turn_taker_.OnClosed();
  const std::string reason = devices_.OnClosing(why);
  line_.OnClosed(reason, now);
  devices_.OnClosed(now.instant);
  clients_.AnswerAll(reason);
}

void Poller::SetInUse(std::uint32_t index, bool in_use, Now now) {
  Advance(now);
  devices_.SetInUse(index, in_use, line_.is_open(), now.instant);
  SettleIfOpen();
}

void Poller::Receive(View bytes, Now now) {
  Advance(now);
  line_.HandleBytes(bytes, now);
  Settle();
}

void Poller::OnEnded(Now now) {
  Advance(now);
  line_.OnEnded(now);
  Settle();
}

void Poller::OnTimer(Now now) {
  Advance(now);
  line_.OnTimer(now);
  if (line_.is_open()) devices_.OnTimer(now);
  Settle();
}

bool Poller::Submit(WriteCommand command, Now now) {
  Advance(now);
  if (!clients_.MakeRoom(now.instant)) return false;
  if (!line_.is_open()) {
    clients_.NotSent(command, devices_.WhyClosed());
  } else {
    clients_.Take(std::move(command), now.instant);
    Settle();
  }
  return true;
}

void Poller::Submit(RoutedRequest request, Now now) {
  Advance(now);
  if (line_.is_open() && clients_.Take(request)) return Settle();
  request.done({Outcome::line_down, {}, devices_.WhyClosed()});
}

void Poller::OnHostClock(bool right) { devices_.OnHostClock(right); }

void Poller::OnUnsettledWrite(std::uint32_t index) { devices_.OnUnsettledWrite(index); }

void Poller::OnEventsKept(std::uint32_t index, const std::string& said, Now now) {
  Advance(now);
  devices_.OnEventsKept(index, said, now.instant);
  SettleIfOpen();
}

void Poller::Abandon(std::uint64_t client, Now now) {
  Advance(now);
  clients_.Abandon(client);
  line_.Abandon(client);
  SettleIfOpen();
}

std::optional<Instant> Poller::Deadline() const {
  if (!line_.is_open()) return std::nullopt;
  return Soonest({line_.Deadline(), clients_.Deadline(), devices_.Deadline(),
                  line_.idle() ? turn_taker_.NextAt(time_.idle()) : std::nullopt});
}

bool Poller::Pause(Now now) {
  const bool rests = turn_taker_.Pause(now.instant);
  return rests && line_.is_open() && line_.idle();
}

void Poller::OnUnansweredTelegram(Now now) {
  Advance(now);
  devices_.OnUnansweredTelegram(now.instant);
}

void Poller::OnWritingTelegram(std::uint32_t device, View telegram, Now now) {
  Advance(now);
  devices_.OnWritingTelegram(device, telegram, now.instant);
}

bool Poller::MayGoOut(Now now) const {
  const Job* const job = turn_taker_.job();
  return job == nullptr || !WhyNotSend(*job, now.instant, true);
}

void Poller::GoOn(Now now) {
  if (!turn_taker_.GoOn() || !line_.is_open()) return;
  Advance(now);
  time_.Restart();
  Settle();
}

void Poller::CallOffWindUp(Now now) {
  turn_taker_.CallOffWindUp();
  Advance(now);
  SettleIfOpen();
}

Speaking Poller::SpeakingAs(std::uint32_t index) const { return devices_.SpeakingAs(index); }

bool Poller::IsWriting() const {
  const Job* const job = turn_taker_.job();
  if (job == nullptr || (job->step.waiting && !job->begun())) return false;
  const auto* const routed = job->As<Job::Routed>();
  return job->As<Job::Write>() != nullptr || (routed != nullptr && !routed->is_read);
}

// ---------------------------------------------------------------- after each input

void Poller::SettleIfOpen() {
  if (line_.is_open()) Settle();
}

void Poller::Settle() {
  line_.HandleEnd();
  time_.OnHandled(line_.idle());
  const Idle idle = time_.idle();
  if (line_.idle()) turn_taker_.ChargeProbe(idle.now);
  line_.Withdraw();
  clients_.AnswerCommands(idle.now);
  clients_.AnswerRouted(idle, turn_taker_.job() == nullptr);
  clients_.AnswerConfirmed(turn_taker_.job());  // before the next write is to be read back
  TakeTurns();
  clients_.AnswerConfirmed(turn_taker_.job());
  devices_.OnSettled(idle.now);
}

void Poller::TakeTurns() {
  while (line_.idle() && turn_taker_.Take(time_.idle()))
    line_.Start(time_.idle().since, time_.now());
}

}  // namespace baudgate::bus
