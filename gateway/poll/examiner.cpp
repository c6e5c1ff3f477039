// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/examiner.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/line/changed_bytes.h"
#include "gateway/line/other_service.h"
#include "gateway/line/words.h"
#include "protocols/assembler.h"
#include "protocols/transaction.h"

namespace baudgate {
namespace {

/// The line was silent before the request, this many times longer than the reply took.
constexpr int kRested = 8;
/// A request that was sent earlier gets no reply any more.
constexpr Duration kLongestLag = 5s;
/// A server that gives wrong numbers gives later ones.
constexpr Duration kLatestByNumber = 10s;
/// Bytes that come later than this behind a request are no reply to it.
constexpr Duration kNoReply = 1min;

}  // namespace

void Examiner::Begin(const Member& member, const Request& request, const LineTimes& times,
                     Instant now) {
  Bytes unanswered;  // what came to its last request
  if (exchange_.member() == &member) unanswered = exchange_.TakeHeard();
  exchange_.Begin(member, request, times, now);
  const Instant sent = exchange_.sent();
  LastTwo& asked = open_[member];
  if (request.expect.reply != Expectation::Reply::none) {  // else it has no finding
    broken_.OnBegin(member);
    ++asked.since;
  }
  const bool again = asked.last.member != nullptr && asked.last.request.bytes == request.bytes;
  Instant first = sent;
  Instant tried = sent;
  Bytes vain;
  if (again && !asked.last.answered && !asked.last.late) {
    if (4 * (sent - asked.last.first) < 5 * times.ceiling) first = asked.last.first;
    if (sent - asked.last.tried < kLongestLag) tried = asked.last.tried;
    if (asked.last.silent) {
      asked.lost = tried;
      asked.since = 1;
    }
    vain = std::move(unanswered);
  } else if (asked.last.member != nullptr && !again) {
    asked.before = std::move(asked.last);
  }
  numbered_.OnSent(member, request.bytes, sent);
  asked.last = {.member = &member,
                .request = request,
                .sent = sent,
                .first = first,
                .tried = tried,
                .vain = std::move(vain),
                .reply = {}};
}

void Examiner::Hear(View bytes, Instant now) {
  if (exchange_.member() == nullptr) greeting_.OnBytes(bytes);
  exchange_.Hear(bytes, now);
}

Finding Examiner::End(Outcome outcome) {
  exchange_.End(outcome);
  const Member* const member = exchange_.member();
  if (member == nullptr) return {};
  const Bytes& request = exchange_.request().bytes;
  const Bytes& heard = exchange_.heard();
  const Bytes& frame = exchange_.frame();
  LastTwo& asked = open_[*member];
  if (ProvesLife(outcome)) {
    asked.last.answered = true;
    asked.last.reply = frame;
    if (asked.misfit.request == request) asked.misfit = {};
    if (LacksSome(asked.last.vain, frame)) {
      earlier_.push_back(
          {member, {.symptom = Symptom::bytes_lost, .bytes = asked.last.vain.size()}, 1});
    }
    numbered_.OnAnswered(frame);
    taken_.Add(request, frame);
    negotiated_ = IsTelnet(greeting_.OnAnswered(heard)) && roster_.is_network();
  }
  asked.last.silent = heard.empty();
  const bool plain = ProvesLife(outcome) && heard.size() == frame.size();
  Finding finding = plain ? Plain(exchange_.AsHearing(roster_)) : Look();
  const bool right = IsAnswered(finding.symptom);
  // A Modbus TCP reply says by its number that it is another one's.
  const bool told = member->protocol->tcp && !finding.remedy.empty();
  if (IsSameAgain(outcome == Outcome::ok) && !right && !told) {
    const bool text = std::ranges::all_of(heard, IsPrintable);
    finding = {.symptom = Symptom::same_again,
               .bytes = heard.size(),
               .cause = text ? Quote(heard) : std::string()};
  }
  const bool speaks = finding.symptom == Symptom::text ||
                      (roster_.is_network() && OtherService(heard, member->protocol->tcp));
  greeting_.OnEnd(heard, speaks);
  if (!IsAnswered(finding.symptom) && !greeting_.text().empty()) {
    finding = Greeting(exchange_.AsHearing(roster_), greeting_.text()).value_or(finding);
  }
  finding.idle = exchange_.idle();
  OnFound(finding.symptom);
  if (finding.symptom == Symptom::tail_lost || finding.symptom == Symptom::end_lost) {
    broken_ = BrokenReply(*member, exchange_.request(), heard, exchange_.last_came());
  }
  return finding;
}

void Examiner::OnFound(Symptom symptom) {
  told_ = symptom;
  if (symptom == Symptom::late) open_[*exchange_.member()].last.late = true;
}

std::optional<Examiner::Earlier> Examiner::TakeEarlier() {
  if (earlier_.empty()) return std::nullopt;
  Earlier earlier = std::move(earlier_.back());
  earlier_.pop_back();
  return earlier;
}

/// When the rest of a reply that broke off has come in this exchange: before or behind the reply
/// that was taken; where none was, before or behind the beginning of another one.
std::optional<Duration> Examiner::RestCame() const {
  const Instant came = exchange_.last_came();
  const auto [before, behind] = exchange_.BesideReply();
  const auto& arrivals = exchange_.arrivals();
  if (broken_.IsRest(before, came) || broken_.IsRest(behind, came)) {
    return (exchange_.frame().empty() ? arrivals.front() : arrivals.back()).after;
  }
  if (!exchange_.frame().empty()) return std::nullopt;
  for (const Arrival& arrival : arrivals) {
    if (broken_.IsRest(View(exchange_.heard()).subspan(arrival.at), came)) return arrival.after;
    if (broken_.IsRest(View(exchange_.heard()).first(arrival.at), came)) {
      return arrivals.front().after;
    }
  }
  return std::nullopt;
}

/// The rest of a reply that broke off has come, in this exchange.
bool Examiner::FindRest() {
  if (exchange_.heard().empty() || !broken_.IsAwaited(exchange_.member())) return false;
  const std::optional<Duration> rest = RestCame();
  if (!rest) return false;
  const Duration pause = exchange_.sent() + *rest - broken_.last();
  earlier_.push_back(
      {&broken_.member(), {.symptom = Symptom::split, .time = pause}, broken_.began()});
  broken_ = {};
  return true;
}

std::optional<Finding> Examiner::More() {
  if (!exchange_.TakeMore()) return std::nullopt;
  Finding finding = Look();
  if (finding.symptom == told_) return std::nullopt;
  if (finding.symptom == Symptom::split) broken_ = {};  // that was its rest
  OnFound(finding.symptom);
  return finding;
}

/// A form that fits several requests proves nothing; what it says may.
bool Examiner::Fits(const Open& open, View frame) {
  const Device* const device = open.member->device;
  return device == nullptr || ProvesLife(device->conversation->Check(open.request.bytes, frame));
}

/// A gateway has waited for the device, and says why there is no reply.
std::optional<Finding> Examiner::InItsPlace(const Open& open, View frame) {
  const Device* const device = open.member->device;
  if (device == nullptr || !open.request.any_order || Fits(open, frame)) return std::nullopt;
  Answer said = device->conversation->Interpret(open.request.bytes, frame);
  if (said.remedy.empty()) return std::nullopt;
  return Finding{
      .symptom = Symptom::odd, .cause = std::move(said.reason), .remedy = std::move(said.remedy)};
}

bool Examiner::Answers(Open& open) const {
  if (open.member == nullptr) return false;
  const Expectation& expect = open.request.expect;
  const bool own = open.member->IsSame(*exchange_.member());
  if (own ? open.request.bytes == exchange_.request().bytes : expect.address.empty()) return false;
  Assembler assembler;
  assembler.Begin(open.member->protocol->reply_rule, expect);
  assembler.Feed(exchange_.heard());
  while (const auto frame = assembler.Next(true)) {
    if (*frame == exchange_.frame()) continue;
    open.in_its_place = InItsPlace(open, *frame);
    if (!open.in_its_place && !Fits(open, *frame)) continue;
    open.repeated = *frame == open.reply;
    return true;
  }
  return false;
}

/// To an earlier request: one without an answer, or once more to one that has its answer.
Examiner::Open* Examiner::FindEarlier() {
  for (LastTwo& asked : open_) {
    for (Open* open : {&asked.last, &asked.before}) {
      if (Answers(*open)) return open;
    }
  }
  return nullptr;
}

/// Beside its own reply there are only such as were taken for other requests just before: something
/// in between sends twice.
bool Examiner::IsCopy() const {
  Assembler assembler;
  assembler.Begin(exchange_.member()->protocol->reply_rule, exchange_.request().expect);
  assembler.Feed(exchange_.heard());
  int copies = 0;
  int others = exchange_.frame().empty() ? 0 : 1;  // its own, of which a copy may come as well
  while (const auto frame = assembler.Next(true)) {
    if (*frame == exchange_.frame()) continue;
    ++(taken_.WasForOther(exchange_.request().bytes, *frame) ? copies : others);
  }
  return copies > 0 && others < 2;
}

/// The same bytes came to other requests before. The transaction number is not compared.
bool Examiner::IsSameAgain(bool right) {
  const Member& member = *exchange_.member();
  const View heard = exchange_.heard();
  const View came = heard.subspan(std::min(heard.size(), TransactionBytes(*member.protocol)));
  // Texts of other values may well be alike; the length of a PDU follows from its request.
  const bool misfit = !ProvesLife(exchange_.outcome()) && member.protocol->carrier != nullptr;
  return open_[member].same.OnCame(came, exchange_.request().bytes, right, misfit,
                                   member.protocol->tcp);
}

/// A request of this gateway has come back so late that it looks like another master's.
bool Examiner::IsLateEcho() const {
  return std::ranges::any_of(open_, [heard = View(exchange_.heard())](const LastTwo& asked) {
    const Bytes& own = asked.last.request.bytes;
    return !own.empty() &&
           std::search(heard.begin(), heard.end(), own.begin(), own.end()) != heard.end();
  });
}

/// A second reply of `member` has come. If one of its requests was lost and repeated lately, one of
/// both replies answers that, and was late.
bool Examiner::IsOfLostTry(const Member& member) {
  LastTwo& asked = open_[member];
  const Duration after = exchange_.last_came() - asked.lost;
  const bool lost = asked.lost != Instant{} && after < kLongestLag;
  if (!lost) asked.doubles = true;
  if (!lost || asked.doubles) return false;
  earlier_.push_back({&member, {.symptom = Symptom::late, .time = after}, asked.since});
  asked.lost = {};
  return true;
}

/// A text that seems to lack a character. If the same comes to the same request again, the device
/// sends another form.
Finding Examiner::Compare(Finding finding) {
  if (finding.symptom == Symptom::bad_check &&
      taken_.IsShorterThanLast(exchange_.request().bytes, exchange_.heard())) {
    finding.symptom = Symptom::bytes_lost;
    finding.cause.clear();
    return finding;
  }
  if (finding.symptom != Symptom::bytes_lost || finding.cause.empty()) return finding;
  TakenReply& misfit = open_[*exchange_.member()].misfit;
  TakenReply now{exchange_.request().bytes, exchange_.heard()};
  if (misfit == now) finding.symptom = Symptom::other_form;
  misfit = std::move(now);
  return finding;
}

Finding Examiner::Look() {
  const bool rest = FindRest();
  const Hearing hearing = exchange_.AsHearing(roster_);
  Finding finding = Examine(hearing);
  if (rest && IsAnswered(finding.symptom)) return Plain(hearing);
  switch (finding.symptom) {
    case Symptom::other_master:
    case Symptom::master_beside:
      if (IsLateEcho()) finding = {.symptom = Symptom::late_echo, .bytes = finding.bytes};
      return finding;
    case Symptom::others_beside:
    case Symptom::copies:
      if (const Open* whose = FindEarlier(); whose != nullptr && whose->answered) {
        if (IsOfLostTry(*whose->member)) return {};
      } else if (finding.bytes > 0 && IsOfLostTry(*exchange_.member())) {
        return {};
      }
      return IsCopy() ? Finding{.symptom = Symptom::copies} : finding;
    case Symptom::bad_check:
    case Symptom::damaged:
    case Symptom::bytes_lost:
      return Compare(std::move(finding));
    case Symptom::two_replies:
      if (IsCopy()) return {.symptom = Symptom::copies};
      if (IsOfLostTry(*exchange_.member())) return earlier_.back().finding;
      [[fallthrough]];
    case Symptom::other_device:
    case Symptom::other_reply:
    case Symptom::odd:
    case Symptom::other_form:
    case Symptom::noise_before:
    case Symptom::noise_behind:
    case Symptom::device_beside:
      return Attribute(std::move(finding));
    default:
      return finding;
  }
}

/// Its reply came `after` its first try, and so soon behind the `next` request; empty: not soon.
Finding Examiner::Late(const Open& open, Duration after, std::optional<Duration> next) {
  if (open.in_its_place) return *open.in_its_place;
  if (open_[*open.member].lag.OnLate(after, next)) {
    return {.symptom = Symptom::one_behind, .cause = "lags"};
  }
  return {.symptom = Symptom::late, .time = after};
}

/// The reply to an earlier request, which its number tells.
std::optional<Finding> Examiner::LateByNumber() {
  const auto late = numbered_.Find(exchange_.heard(), exchange_.last_came());
  if (!late) return std::nullopt;
  const Duration lateness = late->after - late->member->times.reply;
  if (lateness <= Duration::zero() || late->after > kLatestByNumber) return std::nullopt;
  Finding finding{.symptom = Symptom::late, .time = late->after};
  if (late->member->IsSame(*exchange_.member())) return finding;
  earlier_.push_back({late->member, std::move(finding), 0, lateness});
  return Finding{.symptom = Symptom::late_other, .cause = late->member->Name()};
}

/// The finding of this exchange, where what came may be the reply to another request.
Finding Examiner::Attribute(Finding finding) {
  Open* const whose = FindEarlier();
  const std::vector<Arrival>& arrivals = exchange_.arrivals();
  if (arrivals.empty()) return finding;
  if (finding.symptom == Symptom::other_reply && (whose == nullptr || whose->answered)) {
    if (auto late = LateByNumber()) return *late;
  }
  if (whose == nullptr) return finding;
  const bool answered = IsAnswered(finding.symptom);
  const Duration reply = ReplyTime(whose->request, whose->member->times);
  const bool in_front = !exchange_.BesideReply().first.empty();  // of the reply that was taken
  const Arrival& came = in_front ? arrivals.front() : arrivals.back();
  const Duration after = exchange_.sent() + came.after - whose->first;
  const bool late = !whose->answered && after > reply && after < kNoReply;
  // On a busy line every reply comes soon behind a request.
  const bool soon = came.after >= Duration::zero() && came.after < reply / 2 &&
                    exchange_.idle() != kLongIdle && exchange_.idle() > kRested * came.after;
  const auto next = soon ? std::optional(came.after) : std::nullopt;
  if (whose->member->IsSame(*exchange_.member())) {
    if (answered && (!whose->answered || IsOfLostTry(*whose->member))) return {};
    if (answered) return {.symptom = whose->repeated ? Symptom::copies : Symptom::others_beside};
    if (finding.symptom == Symptom::two_replies) {
      return late && whose->silent ? Late(*whose, after, next) : finding;
    }
    // Where replies are numbered, one that is late is known by that.
    if (late && (whose->silent || exchange_.request().any_order)) return Late(*whose, after, next);
    if (arrivals.back().after < reply / 2) return {.symptom = Symptom::one_behind};
    return late ? Late(*whose, after, next) : finding;
  }
  // Its own address in a reply to another master's request is no second reply.
  const bool early = arrivals.back().after < reply / 2;
  if (!late && early && finding.symptom == Symptom::other_device &&
      whose->member->device != nullptr) {
    finding.symptom = Symptom::one_behind;
    return finding;
  }
  if (!late && !(answered && whose->answered)) return finding;
  if (!late && IsOfLostTry(*whose->member)) return {};
  const Symptom again = whose->repeated ? Symptom::copies : Symptom::others_beside;
  const bool news = late && !std::exchange(whose->late, true);
  Finding earlier = news ? Late(*whose, after, next) : Finding{.symptom = again, .time = after};
  if (late && !news) {
    earlier = whose->in_its_place.value_or(Finding{.symptom = Symptom::late, .time = after});
  }
  const bool lags = earlier.symptom == Symptom::one_behind;
  earlier_.push_back(
      {whose->member, std::move(earlier), 0, news ? after - reply : Duration::zero()});
  if (answered) return {};
  if (lags) return {.symptom = Symptom::one_behind, .cause = "lags"};
  return {.symptom = Symptom::late_other, .cause = whose->member->Name()};
}

}  // namespace baudgate
