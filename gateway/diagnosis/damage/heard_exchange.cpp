// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/heard_exchange.h"

#include <algorithm>

namespace baudgate {
namespace {

/// More is not looked at. The longest reply of a Modbus device has 260 bytes.
constexpr std::size_t kMostHeard = 1024;
constexpr std::size_t kMostArrivals = 256;

}  // namespace

void HeardExchange::Begin(const Member& member, const Request& request, const LineTimes& times,
                          Instant now) {
  member_ = &member;
  request_ = request;
  times_ = times;
  idle_ = last_ == Instant{} ? kLongIdle : std::max(now - last_, Duration());
  sent_ = now + TransmissionTime(request, times.character);
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

Hearing HeardExchange::AsHearing(const Roster& roster) const {
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

}  // namespace baudgate
