// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/owed_replies.h"

#include <algorithm>

namespace baudgate {

Exchange OwedReplies::ExchangeOf(const Asked& asked, bool trusted, Instant idle_since,
                                 Instant now) {
  const Member& member = *asked.member;
  const Request& request = *asked.request;
  if (idle_since + late.LongestReply() <= now) readings.OnRested();
  // Its user says that nothing holds its replies back. A first try has waited for late replies, so
  // nothing is owed any more.
  if (trusted && !asked.retry) orders.Reset(member);
  Exchange exchange{request, member.protocol->reply_rule, member.times, {}, {}};
  exchange.lags = whose.Lags(member);
  exchange.times.reply += late.MoreReply(asked);
  const Duration more = request.reply - exchange.times.reply;
  if (more > Duration::zero()) {
    exchange.times.reply += more;
    exchange.times.ceiling += more;
  }
  exchange.times.quiet = std::max(exchange.times.quiet, request.quiet);
  exchange.times.drain += late.ExtraDrain(member);
  exchange.aftermath = late.Aftermath(asked, now);
  // This device answers each request only after the next one. Waiting does not help.
  if (exchange.lags) exchange.aftermath = std::min(exchange.aftermath, member.times.drain);
  return exchange;
}

}  // namespace baudgate
