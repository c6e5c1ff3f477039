// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/broken_reply.h"

#include <algorithm>

#include "protocols/assembler.h"

namespace baudgate {
namespace {

/// Bytes that begin like the broken reply are a new reply, not its rest.
constexpr std::size_t kFront = 2;
/// A rest that comes later belongs to no exchange.
constexpr Duration kLatest = 5s;

}  // namespace

/// A rest may come, and not in the exchange in which the reply broke off.
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

/// Behind the beginning it makes a whole reply, and it is none by itself.
bool BrokenReply::IsRest(View rest, Instant came) const {
  // Replies of a connection are whole, or their header says how much is missing.
  if (rest.empty() || member_->protocol->tcp || came - last_ > kLatest) return false;
  const std::size_t same = std::min({rest.size(), begin_.size(), kFront});
  if (std::ranges::equal(rest.first(same), View(begin_).first(same))) return false;
  Bytes whole = begin_;
  Append(whole, rest);
  Assembler assembler;
  assembler.Begin(member_->protocol->reply_rule, request_.expect);
  assembler.Feed(whole);
  const auto frame = assembler.Next(true);
  return frame && whole.size() - assembler.held() - frame->size() < begin_.size();
}

}  // namespace baudgate
