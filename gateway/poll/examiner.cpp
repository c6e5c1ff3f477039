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

/// More is not looked at. The longest reply of a Modbus device has 260 bytes.
constexpr std::size_t kKept = 1024;
constexpr std::size_t kArrivals = 256;
constexpr std::size_t kTaken = 8;
/// So many characters may be missing inside a text.
constexpr std::size_t kFewLost = 2;
/// The line was silent before the request, this many times longer than the reply took.
constexpr int kRested = 8;
/// A request that was sent earlier gets no reply any more.
constexpr Duration kLongestLag = 5s;

}  // namespace

void Examiner::Begin(const Member& member, const Request& request, const LineTimes& times,
                     Instant now) {
  times_ = times;
  idle_ = last_ == Instant{} ? kLongIdle : std::max(now - last_, Duration());
  sent_ = now + static_cast<std::int64_t>(request.bytes.size()) * times.character;
  last_ = sent_;
  broken_.OnBegin(member);
  LastTwo& asked = open_[member];
  ++asked.since;
  const bool again = asked.last.member != nullptr && asked.last.request.bytes == request.bytes;
  Instant first = sent_;
  Instant tried = sent_;
  Bytes vain;
  if (again && !asked.last.answered && !asked.last.late) {
    if (4 * (sent_ - asked.last.first) < 5 * times.ceiling) first = asked.last.first;
    if (sent_ - asked.last.tried < kLongestLag) tried = asked.last.tried;
    if (asked.last.silent) {
      asked.lost = tried;
      asked.since = 1;
    }
    if (member_ == &member) vain = std::move(heard_);
  } else if (asked.last.member != nullptr && !again) {
    asked.before = std::move(asked.last);
  }
  asked.last = {.member = &member,
                .request = request,
                .sent = sent_,
                .first = first,
                .tried = tried,
                .vain = std::move(vain),
                .reply = {}};
  member_ = &member;
  request_ = request;
  outcome_ = Outcome::none;
  frame_.clear();
  judged_ = 0;
  heard_.clear();
  arrivals_.clear();
}

void Examiner::Hear(View bytes, Instant now) {
  last_ = std::max(last_, now);
  if (member_ == nullptr) {
    Append(greeting_, bytes.first(std::min(bytes.size(), kKept - greeting_.size())));
    return;
  }
  if (heard_.size() >= kKept) return;
  if (arrivals_.size() < kArrivals) arrivals_.push_back({heard_.size(), now - sent_});
  Append(heard_, bytes.first(std::min(bytes.size(), kKept - heard_.size())));
}

Finding Examiner::End(Outcome outcome) {
  outcome_ = outcome;
  judged_ = heard_.size();
  if (member_ == nullptr) return {};
  if (ProvesLife(outcome)) {
    Open& last = open_[*member_].last;
    last.answered = true;
    last.reply = frame_;
    if (Taken& misfit = open_[*member_].misfit; misfit.request == request_.bytes) misfit = {};
    if (LacksSome(last.vain, frame_)) {
      earlier_.push_back({member_, {.symptom = Symptom::bytes_lost, .bytes = last.vain.size()}, 1});
    }
    taken_.push_back({request_.bytes, frame_});
    if (taken_.size() > kTaken) taken_.pop_front();
    const View first = greeting_.empty() && fresh_ ? View(heard_) : View(greeting_);
    negotiated_ = roster_.is_network() && IsTelnet(first);
    greeting_.clear();  // it has kept nobody from answering
  }
  open_[*member_].last.silent = heard_.empty();
  if (!ProvesLife(outcome)) frame_.clear();
  const bool plain = ProvesLife(outcome) && heard_.size() == frame_.size();
  Finding finding = plain ? Plain(Heard()) : Look();
  const bool right = IsAnswered(finding.symptom);
  // A Modbus TCP reply says by its number that it is another one's.
  const bool told = member_->protocol->tcp && !finding.remedy.empty();
  if (IsSameAgain(outcome == Outcome::ok) && !right && !told) {
    const bool text = std::ranges::all_of(heard_, IsPrintable);
    finding = {.symptom = Symptom::same_again,
               .bytes = heard_.size(),
               .cause = text ? Quote(heard_) : std::string()};
  }
  // What a server says at once may meet the first request.
  const bool says =
      finding.symptom == Symptom::text ||
      (roster_.is_network() && OtherService(heard_, member_->protocol->tcp).has_value());
  if (std::exchange(fresh_, false) && says && greeting_.empty()) greeting_ = heard_;
  const bool greeted = !IsAnswered(finding.symptom) && !greeting_.empty();
  if (greeted) finding = Greeting(Heard(), greeting_).value_or(finding);
  finding.idle = idle_;
  OnFound(finding.symptom);
  if (finding.symptom == Symptom::tail_lost || finding.symptom == Symptom::end_lost) {
    broken_ = BrokenReply(*member_, request_, heard_, arrivals_.back().after + sent_);
  }
  return finding;
}

void Examiner::OnFound(Symptom symptom) {
  told_ = symptom;
  if (symptom == Symptom::late) open_[*member_].last.late = true;
}

std::optional<Examiner::Earlier> Examiner::TakeEarlier() {
  if (earlier_.empty()) return std::nullopt;
  Earlier earlier = std::move(earlier_.back());
  earlier_.pop_back();
  return earlier;
}

/// What was heard before and after the reply that was taken; without one, before it.
std::pair<View, View> Examiner::BesideReply() const {
  const View heard = heard_;
  const auto found = std::search(heard.begin(), heard.end(), frame_.begin(), frame_.end());
  if (frame_.empty() || found == heard.end()) return {heard, {}};
  View behind(found + static_cast<std::ptrdiff_t>(frame_.size()), heard.end());
  while (!behind.empty() && (behind[0] == '\r' || behind[0] == '\n')) behind = behind.subspan(1);
  return {View(heard.begin(), found), behind};
}

/// The rest of a reply that broke off has come, in this exchange.
bool Examiner::FindRest() {
  if (heard_.empty() || !broken_.IsAwaited(member_)) return false;
  const Instant came = sent_ + arrivals_.back().after;
  const auto [before, behind] = BesideReply();
  if (!broken_.IsRest(before, came) && !broken_.IsRest(behind, came)) return false;
  // One that was taken may stand in front of the rest.
  const Arrival& rest = frame_.empty() ? arrivals_.front() : arrivals_.back();
  const Duration pause = sent_ + rest.after - broken_.last();
  earlier_.push_back(
      {&broken_.member(), {.symptom = Symptom::split, .time = pause}, broken_.began()});
  broken_ = {};
  return true;
}

std::optional<Finding> Examiner::More() {
  if (member_ == nullptr || outcome_ == Outcome::none || heard_.size() == judged_)
    return std::nullopt;
  judged_ = heard_.size();
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
  const bool own = open.member->IsSame(*member_);
  if (own ? open.request.bytes == request_.bytes : expect.address.empty()) return false;
  Assembler assembler;
  assembler.Begin(open.member->protocol->reply_rule, expect);
  assembler.Feed(heard_);
  while (const auto frame = assembler.Next(true)) {
    if (*frame == frame_) continue;
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
  assembler.Begin(member_->protocol->reply_rule, request_.expect);
  assembler.Feed(heard_);
  int copies = 0;
  int others = frame_.empty() ? 0 : 1;  // its own, of which a copy may come as well
  while (const auto frame = assembler.Next(true)) {
    if (*frame == frame_) continue;
    const bool known = std::ranges::any_of(taken_, [&](const Taken& one) {
      return one.request != request_.bytes && one.reply == *frame;
    });
    ++(known ? copies : others);
  }
  return copies > 0 && others < 2;
}

/// The same bytes came to other requests before. The transaction number is not compared.
bool Examiner::IsSameAgain(bool right) {
  const bool numbered = member_->protocol->tcp;
  const View came =
      View(heard_).subspan(std::min(heard_.size(), TransactionBytes(*member_->protocol)));
  // Texts of other values may well be alike; the length of a PDU follows from its request.
  const bool misfit = !ProvesLife(outcome_) && member_->protocol->carrier != nullptr;
  return open_[*member_].same.OnCame(came, request_.bytes, right, misfit, numbered);
}

/// A request of this gateway has come back so late that it looks like another master's.
bool Examiner::IsLateEcho() const {
  return std::ranges::any_of(open_, [this](const LastTwo& asked) {
    const Bytes& own = asked.last.request.bytes;
    return !own.empty() &&
           std::search(heard_.begin(), heard_.end(), own.begin(), own.end()) != heard_.end();
  });
}

Hearing Examiner::Heard() const {
  return {.protocol = member_->protocol,
          .options = &member_->options,
          .request = request_.bytes,
          .expect = &request_.expect,
          .outcome = outcome_,
          .heard = heard_,
          .arrivals = arrivals_,
          .reply = std::max(times_.reply, request_.reply),
          .gap = times_.gap,
          .connection = roster_.is_network(),
          .foreign = roster_.foreign()};
}

/// A second reply of `member` has come. If one of its requests was lost and repeated lately, one of
/// both replies answers that, and was late.
bool Examiner::IsOfLostTry(const Member& member) {
  LastTwo& asked = open_[member];
  const Duration after = sent_ + arrivals_.back().after - asked.lost;
  const bool lost = asked.lost != Instant{} && after < kLongestLag;
  if (!lost) asked.doubles = true;
  if (!lost || asked.doubles) return false;
  earlier_.push_back({&member, {.symptom = Symptom::late, .time = after}, asked.since});
  asked.lost = {};
  return true;
}

/// A text of which the check value is wrong, and which is a character or two shorter than the last
/// good reply to the same request.
bool Examiner::IsShorterThanLast() const {
  if (!std::ranges::all_of(request_.bytes, IsPrintable)) return false;
  const auto last = std::find_if(taken_.rbegin(), taken_.rend(), [this](const Taken& one) {
    return one.request == request_.bytes;
  });
  if (last == taken_.rend() || heard_.front() != last->reply.front()) return false;
  return heard_.size() < last->reply.size() && heard_.size() + kFewLost >= last->reply.size();
}

/// A text that seems to lack a character. If the same comes to the same request again, the device
/// sends another form.
Finding Examiner::Compare(Finding finding) {
  if (finding.symptom == Symptom::bad_check && IsShorterThanLast()) {
    finding.symptom = Symptom::bytes_lost;
    finding.cause.clear();
    return finding;
  }
  if (finding.symptom != Symptom::bytes_lost || finding.cause.empty()) return finding;
  Taken& misfit = open_[*member_].misfit;
  if (misfit.request == request_.bytes && misfit.reply == heard_) {
    finding.symptom = Symptom::other_form;
  }
  misfit = {request_.bytes, heard_};
  return finding;
}

Finding Examiner::Look() {
  const bool rest = FindRest();
  Finding finding = Examine(Heard());
  if (rest && IsAnswered(finding.symptom)) return Plain(Heard());
  switch (finding.symptom) {
    case Symptom::other_master:
    case Symptom::master_beside:
      if (IsLateEcho()) finding = {.symptom = Symptom::late_echo, .bytes = finding.bytes};
      return finding;
    case Symptom::others_beside:
    case Symptom::copies:
      if (const Open* whose = FindEarlier(); whose != nullptr && whose->answered) {
        if (IsOfLostTry(*whose->member)) return {};
      } else if (finding.bytes > 0 && IsOfLostTry(*member_)) {
        return {};
      }
      return IsCopy() ? Finding{.symptom = Symptom::copies} : finding;
    case Symptom::bad_check:
    case Symptom::damaged:
    case Symptom::bytes_lost:
      return Compare(std::move(finding));
    case Symptom::two_replies:
      if (IsCopy()) return {.symptom = Symptom::copies};
      if (IsOfLostTry(*member_)) return earlier_.back().finding;
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

/// The finding of this exchange, where what came may be the reply to another request.
Finding Examiner::Attribute(Finding finding) {
  Open* const whose = FindEarlier();
  if (whose == nullptr || arrivals_.empty()) return finding;
  const bool answered = IsAnswered(finding.symptom);
  const Duration reply = std::max(whose->member->times.reply, whose->request.reply);
  const bool in_front = !BesideReply().first.empty();  // of the reply that was taken
  const Arrival& came = in_front ? arrivals_.front() : arrivals_.back();
  const Duration after = sent_ + came.after - whose->first;
  const bool late = !whose->answered && after > reply;
  // On a busy line every reply comes soon behind a request.
  const bool soon = came.after >= Duration::zero() && came.after < reply / 2 &&
                    idle_ != kLongIdle && idle_ > kRested * came.after;
  const auto next = soon ? std::optional(came.after) : std::nullopt;
  if (whose->member->IsSame(*member_)) {
    if (answered && (!whose->answered || IsOfLostTry(*whose->member))) return {};
    if (answered) return {.symptom = whose->repeated ? Symptom::copies : Symptom::others_beside};
    if (finding.symptom == Symptom::two_replies) {
      return late && whose->silent ? Late(*whose, after, next) : finding;
    }
    // Where replies are numbered, one that is late is known by that.
    if (late && (whose->silent || request_.any_order)) return Late(*whose, after, next);
    if (arrivals_.back().after < reply / 2) return {.symptom = Symptom::one_behind};
    return late ? Late(*whose, after, next) : finding;
  }
  // Its own address in a reply to another master's request is no second reply.
  const bool early = arrivals_.back().after < reply / 2;
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
  const Device* const other = whose->member->device;
  return {.symptom = Symptom::late_other,
          .cause = other == nullptr ? "slave " + std::to_string(whose->member->slave)
                                    : other->config->name};
}

}  // namespace baudgate
