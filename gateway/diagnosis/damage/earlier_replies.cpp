// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/earlier_replies.h"

#include <utility>

#include "gateway/diagnosis/damage/changed_bytes.h"
#include "protocols/assembler.h"

namespace baudgate::diagnosis {
namespace {

/// If this many first bytes equal those of the stored reply, the bytes are a new reply, not its
/// rest.
constexpr std::size_t kFront = 2;
/// The rest of a broken reply is expected for this time.
constexpr Duration kLatest = 5s;

}  // namespace

/// True if a reply is stored and the exchange came after the exchange in which the reply broke off.
bool BrokenReply::IsAwaited(const HeardExchange& exchange) const {
  return member_ != nullptr && (member_ != exchange.member() || began_ > 0);
}

std::optional<Duration> BrokenReply::FindRest(const HeardExchange& exchange) const {
  if (exchange.heard().empty() || !IsAwaited(exchange)) return std::nullopt;
  const Instant came = exchange.last_came();
  const auto [before, behind] = exchange.BesideReply();
  const auto& arrivals = exchange.arrivals();
  if (IsRest(before, came) || IsRest(behind, came)) {
    return (exchange.frame().empty() ? arrivals.front() : arrivals.back()).after;
  }
  if (!exchange.frame().empty()) return std::nullopt;
  const View heard = exchange.heard();
  for (const Arrival& arrival : arrivals) {
    if (IsRest(heard.subspan(arrival.at), came)) return arrival.after;
    if (IsRest(heard.first(arrival.at), came)) return arrivals.front().after;
  }
  return std::nullopt;
}

bool BrokenReply::IsRest(View rest, Instant came) const {
  // A Modbus TCP reply has no rest: it comes complete, or its header contains the missing length.
  if (rest.empty() || member_->protocol->tcp || came - last_ > kLatest) return false;
  const std::size_t same = std::min({rest.size(), begin_.size(), kFront});
  if (std::ranges::equal(rest.first(same), View(begin_).first(same))) return false;
  Bytes whole = begin_;
  Append(whole, rest);
  protocols::Assembler assembler;
  assembler.Begin(member_->protocol->reply_rule, request_.expect);
  assembler.Feed(whole);
  const auto frame = assembler.Next(true);
  return frame && whole.size() - assembler.held() - frame->size() < begin_.size();
}

namespace {

/// The line counts as rested if its silence before the request was this many times the time to the
/// reply.
constexpr int kRested = 8;
/// A server that numbers its replies correctly may answer this late. A later reply has a wrong
/// number.
constexpr Duration kLatestByNumber = 10s;
/// Bytes that come later than this after a request are not its reply.
constexpr Duration kNoReply = 1min;

/// True if the content of the frame answers the request. (The form of a frame can fit several
/// requests.)
bool Fits(const bus::Member& member, const protocols::Request& request, View frame) {
  const bus::Device* const device = member.device;
  return device == nullptr || ProvesLife(device->conversation->Check(request.bytes, frame));
}

/// A gateway in front of a device can report in a frame that the device does not answer. Returns a
/// finding with the reason if the frame is such a report.
std::optional<Finding> InItsPlace(const bus::Member& member, const protocols::Request& request,
                                  View frame) {
  const bus::Device* const device = member.device;
  if (device == nullptr || !request.numbered || Fits(member, request, frame)) return std::nullopt;
  protocols::Answer said = device->conversation->Interpret(request.bytes, frame);
  if (said.remedy.empty()) return std::nullopt;
  return Finding{
      .symptom = Symptom::odd, .cause = std::move(said.reason), .remedy = std::move(said.remedy)};
}

}  // namespace

// ---------------------------------------------------------------- storing

void EarlierReplies::OnBegin(const HeardExchange& exchange, Bytes unanswered) {
  const bus::Member& member = *exchange.member();
  const protocols::Request& request = exchange.request();
  const Instant sent = exchange.sent();
  LastTwo& asked = open_[member];
  if (request.expect.reply != protocols::Expectation::Reply::none) {  // a broadcast has no finding
    broken_.OnBegin(member);
    habits_.OnBegin(member);
  }
  const bool again = asked.last.member != nullptr && asked.last.request.AsksTheSameAs(request);
  Open next{.member = &member,
            .request = request,
            .sent = sent,
            .first = sent,
            .tried = sent,
            .vain = {},
            .reply = {}};
  if (again && !asked.last.answered && !asked.last.late) {
    const Duration ceiling = exchange.times().ceiling;
    if (4 * (sent - asked.last.first) < 5 * ceiling) next.first = asked.last.first;
    if (sent - asked.last.tried < kLongestLag) next.tried = asked.last.tried;
    if (asked.last.silent) habits_.OnLost(member, next.tried);
    next.vain = std::move(unanswered);
  } else if (asked.last.member != nullptr && !again) {
    asked.before = std::move(asked.last);
  }
  numbered_.OnSent(member, request, sent);
  beside_.clear();
  asked.last = std::move(next);
}

void EarlierReplies::OnAnswered(const HeardExchange& exchange) {
  const bus::Member& member = *exchange.member();
  const Bytes& frame = exchange.frame();
  Open& last = open_[member].last;
  last.answered = true;
  last.reply = frame;
  if (LacksSome(last.vain, frame)) {
    found_.push_back({&member, {.symptom = Symptom::bytes_lost, .bytes = last.vain.size()}, 1});
  }
  numbered_.OnAnswered(frame);
}

void EarlierReplies::NoteSilence(const HeardExchange& exchange) {
  open_[*exchange.member()].last.silent = exchange.heard().empty();
}

void EarlierReplies::OnBroken(const HeardExchange& exchange) {
  broken_ =
      BrokenReply(*exchange.member(), exchange.request(), exchange.heard(), exchange.last_came());
}

std::optional<EarlierFinding> EarlierReplies::Take() {
  if (found_.empty()) return std::nullopt;
  EarlierFinding earlier = std::move(found_.back());
  found_.pop_back();
  return earlier;
}

// ---------------------------------------------------------------- finding

bool EarlierReplies::FindRest(const HeardExchange& exchange) {
  const std::optional<Duration> rest = broken_.FindRest(exchange);
  if (!rest) return false;
  const Duration pause = exchange.sent() + *rest - broken_.last();
  found_.push_back(
      {&broken_.member(), {.symptom = Symptom::split, .time = pause}, broken_.began()});
  broken_ = {};
  return true;
}

bool EarlierReplies::FindBeside(const HeardExchange& exchange, const Finding& finding) {
  if (const Open* whose = FindEarlier(exchange); whose != nullptr && whose->answered) {
    return FindLostTry(*whose->member, exchange.last_came()).has_value();
  }
  return finding.bytes > 0 && FindLostTry(*exchange.member(), exchange.last_came()).has_value();
}

std::optional<Finding> EarlierReplies::FindLostTry(const bus::Member& member, Instant came) {
  const auto lost = habits_.TakeLostTry(member, came);
  if (!lost) return std::nullopt;
  found_.push_back({&member, {.symptom = Symptom::late, .time = lost->after}, lost->back});
  return found_.back().finding;
}

bool EarlierReplies::IsLateEcho(const HeardExchange& exchange) const {
  return std::ranges::any_of(open_, [heard = View(exchange.heard())](const LastTwo& asked) {
    const Bytes& own = asked.last.request.bytes;
    return !own.empty() &&
           std::search(heard.begin(), heard.end(), own.begin(), own.end()) != heard.end();
  });
}

/// Returns an earlier request that the bytes answer, whether it was answered before or not; null:
/// there is no such request.
EarlierReplies::Open* EarlierReplies::FindEarlier(const HeardExchange& exchange) {
  for (LastTwo& asked : open_) {
    for (Open* open : {&asked.last, &asked.before}) {
      if (TakeIfAnswered(*open, exchange)) return open;
    }
  }
  return nullptr;
}

/// True if the bytes contain a reply to the request `open`. Sets its fields in_its_place and
/// repeated.
bool EarlierReplies::TakeIfAnswered(Open& open, const HeardExchange& exchange) {
  if (open.member == nullptr) return false;
  const protocols::Expectation& expect = open.request.expect;
  const bool own = open.member->IsSame(*exchange.member());
  if (own ? open.request.AsksTheSameAs(exchange.request()) : expect.address.empty()) return false;
  protocols::Assembler assembler;
  assembler.Begin(open.member->protocol->reply_rule, expect);
  assembler.Feed(exchange.heard());
  while (const auto frame = assembler.Next(true)) {
    if (*frame == exchange.frame()) continue;
    open.in_its_place = InItsPlace(*open.member, open.request, *frame);
    if (!open.in_its_place && !Fits(*open.member, open.request, *frame)) continue;
    open.repeated = *frame == open.reply;
    return true;
  }
  return false;
}

EarlierReplies::Came EarlierReplies::CameOf(const HeardExchange& exchange, const Open& whose) {
  const std::vector<Arrival>& arrivals = exchange.arrivals();
  const Duration reply = ReplyTime(whose.request, whose.member->times);
  const bool in_front = !exchange.BesideReply().first.empty();
  const Duration behind = (in_front ? arrivals.front() : arrivals.back()).after;
  Came came;
  came.after = exchange.sent() + behind - whose.first;
  came.lateness = came.after - reply;
  came.late = !whose.answered && came.after > reply && came.after < kNoReply;
  came.early = arrivals.back().after < reply / 2;
  // On a busy line every reply comes soon after some request, so a silence before the request is
  // required.
  const bool soon = behind >= Duration::zero() && behind < reply / 2 &&
                    exchange.idle() != kLongIdle && exchange.idle() > kRested * behind;
  if (soon) came.next = behind;
  return came;
}

Finding EarlierReplies::Late(const Open& open, const Came& came) {
  if (open.in_its_place) return *open.in_its_place;
  if (habits_.OnLate(*open.member, came.after, came.next)) {
    return {.symptom = Symptom::one_behind, .cause = "lags"};
  }
  return {.symptom = Symptom::late, .time = came.after};
}

/// Finds by its number the earlier request that the reply answers.
std::optional<Finding> EarlierReplies::LateByNumber(const HeardExchange& exchange) {
  const auto late = numbered_.Find(exchange.heard(), exchange.last_came());
  if (!late) return std::nullopt;
  if (late->lateness <= Duration::zero() || late->after > kLatestByNumber) return std::nullopt;
  Finding finding{.symptom = Symptom::late, .time = late->after};
  if (late->member->IsSame(*exchange.member())) return finding;
  found_.push_back({late->member, std::move(finding), 0});
  return Finding{.symptom = Symptom::late_other, .cause = late->member->Name()};
}

/// True if the bytes after the reply answer a first try whose retry was answered before.
bool EarlierReplies::FindNumberedBeside(const HeardExchange& exchange) {
  const View behind = exchange.BesideReply().second;
  if (behind.empty()) return false;
  if (std::ranges::equal(behind, beside_)) return true;  // the bytes were attributed already
  const auto late = numbered_.Find(behind, exchange.last_came());
  if (!late || late->lateness <= Duration::zero() || late->after > kLatestByNumber) return false;
  if (!FindLostTry(*late->member, exchange.last_came())) return false;
  found_.back().finding.time = late->after;
  beside_.assign(behind.begin(), behind.end());
  numbered_.OnAnswered(behind);
  return true;
}

Finding EarlierReplies::Attribute(const HeardExchange& exchange, Finding finding) {
  if (IsAnswered(finding.symptom) && FindNumberedBeside(exchange)) return {};
  Open* const whose = FindEarlier(exchange);
  if (exchange.arrivals().empty()) return finding;
  if (finding.symptom == Symptom::other_reply && (whose == nullptr || whose->answered)) {
    if (auto late = LateByNumber(exchange)) return *late;
  }
  if (whose == nullptr) return finding;
  const Came came = CameOf(exchange, *whose);
  return whose->member->IsSame(*exchange.member())
             ? AttributeToItself(exchange, *whose, came, std::move(finding))
             : AttributeToAnother(exchange, *whose, came, std::move(finding));
}

Finding EarlierReplies::AttributeToItself(const HeardExchange& exchange, const Open& whose,
                                          const Came& came, Finding finding) {
  if (IsAnswered(finding.symptom)) {
    if (!whose.answered || FindLostTry(*whose.member, exchange.last_came())) return {};
    return {.symptom = whose.repeated ? Symptom::copies : Symptom::others_beside};
  }
  if (finding.symptom == Symptom::two_replies) {
    return came.late && whose.silent ? Late(whose, came) : finding;
  }
  // If replies carry numbers, the number proves that the reply is late.
  if (came.late && (whose.silent || exchange.request().numbered)) return Late(whose, came);
  if (came.early) return {.symptom = Symptom::one_behind};
  return came.late ? Late(whose, came) : finding;
}

Finding EarlierReplies::AttributeToAnother(const HeardExchange& exchange, Open& whose,
                                           const Came& came, Finding finding) {
  const bool answered = IsAnswered(finding.symptom);
  // Another master may have asked this device. A reply with its address is then no second reply.
  if (!came.late && came.early && finding.symptom == Symptom::other_device &&
      whose.member->device != nullptr) {
    finding.symptom = Symptom::one_behind;
    return finding;
  }
  if (!came.late && !(answered && whose.answered)) return finding;
  if (!came.late && FindLostTry(*whose.member, exchange.last_came())) return {};
  const Symptom again = whose.repeated ? Symptom::copies : Symptom::others_beside;
  const bool news = came.late && !std::exchange(whose.late, true);
  Finding earlier = news ? Late(whose, came) : Finding{.symptom = again, .time = came.after};
  if (came.late && !news) {
    earlier = whose.in_its_place.value_or(Finding{.symptom = Symptom::late, .time = came.after});
  }
  const bool lags = earlier.symptom == Symptom::one_behind;
  found_.push_back({whose.member, std::move(earlier), 0});
  if (answered) return {};
  if (lags) return {.symptom = Symptom::one_behind, .cause = "lags"};
  return {.symptom = Symptom::late_other, .cause = whose.member->Name()};
}

}  // namespace baudgate::diagnosis
