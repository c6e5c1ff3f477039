// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/reply_habits.h"

#include "protocols/assembler.h"
#include "protocols/protocol.h"

namespace baudgate::diagnosis {
namespace {

/// In bytes: more bytes of an exchange are ignored. The longest reply of a Modbus device has 260
/// bytes.
constexpr std::size_t kMostHeard = 1024;
constexpr std::size_t kMostArrivals = 256;

}  // namespace

void HeardExchange::Begin(const bus::Member& member, const protocols::Request& request,
                          const bus::LineTimes& times, Instant now) {
  member_ = &member;
  request_ = request;
  times_ = times;
  idle_ = last_ == Instant{} ? kLongIdle : std::max(now - last_, Duration());
  sent_ = now + bus::TransmissionTime(request, times.character);
  last_ = sent_;
  outcome_ = Outcome::none;
  judged_ = 0;
  heard_.clear();
  arrivals_.clear();
  frame_.clear();
}

void HeardExchange::Hear(View bytes, Instant now) {
  last_ = std::max(last_, now);
  if (member_ == nullptr || heard_.size() >= kMostHeard) return;
  if (arrivals_.size() < kMostArrivals) arrivals_.push_back({heard_.size(), now - sent_});
  Append(heard_, bytes.first(std::min(bytes.size(), kMostHeard - heard_.size())));
}

void HeardExchange::End(Outcome outcome) {
  outcome_ = outcome;
  judged_ = heard_.size();
  if (!ProvesLife(outcome)) frame_.clear();
}

bool HeardExchange::TakeMore() {
  if (member_ == nullptr || outcome_ == Outcome::none) return false;
  return std::exchange(judged_, heard_.size()) != heard_.size();
}

std::pair<View, View> HeardExchange::BesideReply() const {
  const View heard = heard_;
  const auto found = std::search(heard.begin(), heard.end(), frame_.begin(), frame_.end());
  if (frame_.empty() || found == heard.end()) return {heard, {}};
  View behind(found + static_cast<std::ptrdiff_t>(frame_.size()), heard.end());
  while (!behind.empty() && (behind[0] == '\r' || behind[0] == '\n')) behind = behind.subspan(1);
  return {View(heard.begin(), found), behind};
}

Hearing HeardExchange::AsHearing(const bus::Roster& roster) const {
  return {.protocol = member_->protocol,
          .options = &member_->options,
          .request = request_.bytes,
          .expect = &request_.expect,
          .outcome = outcome_,
          .heard = heard_,
          .arrivals = arrivals_,
          .reply = ReplyTime(request_, times_),
          .gap = times_.gap,
          .connection = roster.is_network(),
          .foreign = roster.foreign()};
}

void ReplyHabits::OnLost(const bus::Member& member, Instant tried) {
  Entry& entry = of_[member];
  entry.lost = tried;
  entry.since = 1;
}

void ReplyHabits::OnAnswered(const HeardExchange& exchange) {
  const Bytes& request = exchange.request().bytes;
  TakenReply& misfit = of_[*exchange.member()].misfit;
  if (misfit.request == request) misfit = {};
  taken_.Add(request, exchange.frame());
}

std::optional<ReplyHabits::LostTry> ReplyHabits::TakeLostTry(const bus::Member& member,
                                                             Instant came) {
  Entry& entry = of_[member];
  const Duration after = came - entry.lost;
  const bool lost = entry.lost != Instant{} && after < kLongestLag;
  if (!lost) entry.doubles = true;
  if (!lost || entry.doubles) return std::nullopt;
  entry.lost = {};
  return LostTry{after, entry.since};
}

bool ReplyHabits::NoteSame(const HeardExchange& exchange, bool right) {
  const bus::Member& member = *exchange.member();
  const View heard = exchange.heard();
  const View came = heard.subspan(std::min(heard.size(), TransactionBytes(*member.protocol)));
  // Equal bytes are a misfit only if the length of a reply follows from its request (PDU). Texts
  // with different values may be equal by chance.
  const bool misfit = !ProvesLife(exchange.outcome()) && member.protocol->carrier != nullptr;
  if (right) of_[member].right = exchange.heard();
  return of_[member].same.OnCame(came, exchange.request().bytes, right, misfit,
                                 member.protocol->tcp);
}

bool ReplyHabits::IsCopy(const HeardExchange& exchange) const {
  protocols::Assembler assembler;
  assembler.Begin(exchange.member()->protocol->reply_rule, exchange.request().expect);
  assembler.Feed(exchange.heard());
  int copies = 0;
  int others = exchange.frame().empty() ? 0 : 1;  // includes the reply to this request
  while (const auto frame = assembler.Next(true)) {
    if (*frame == exchange.frame()) continue;
    ++(taken_.WasForOther(exchange.request().bytes, *frame) ? copies : others);
  }
  return copies > 0 && others < 2;
}

Finding ReplyHabits::Compare(const HeardExchange& exchange, Finding finding) {
  const Bytes& request = exchange.request().bytes;
  if (finding.symptom == Symptom::bad_check &&
      taken_.IsShorterThanLast(request, exchange.heard())) {
    finding.symptom = Symptom::bytes_lost;
    finding.cause.clear();
    return finding;
  }
  if (finding.symptom != Symptom::bytes_lost || finding.cause.empty()) return finding;
  TakenReply& misfit = of_[*exchange.member()].misfit;
  TakenReply now{request, exchange.heard()};
  if (misfit == now) finding.symptom = Symptom::other_form;
  misfit = std::move(now);
  return finding;
}

}  // namespace baudgate::diagnosis
