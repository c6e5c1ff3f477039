// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/telegram_exchange.h"

#include <utility>

namespace baudgate::bus {

namespace {

/// In bytes. Later bytes of a reply are dropped.
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

}  // namespace baudgate::bus
