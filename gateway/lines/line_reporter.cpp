// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_reporter.h"

#include "gateway/base/log.h"
#include "gateway/base/outcome.h"
#include "gateway/bus/exchange/tap.h"

namespace baudgate {

void LineReporter::OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                                 const std::string& reason, Now at) {
  TellState(device, from, to, reason, at);
  log::About about{line_.name, std::string(recorder_.NameOf(device))};
  if (to == DeviceState::online) {
    log::Info(about, "{} (was {})", Name(to), Name(from));
  } else if (to == DeviceState::disabled || from == DeviceState::disabled) {
    log::Info(about, "{} (was {}): {}", Name(to), Name(from), reason);
  } else {
    const auto take = [&](const DeviceRecord& record) {
      about.outcome = Name(record.status.last_outcome);
    };
    if (device < kFirstSlave) store_.Read(device, take);  // the store has no slaves of routes
    log::Warn(about, "{} (was {}): {}", Name(to), Name(from), reason);
  }
}

void LineReporter::OnWarning(std::uint32_t device, const std::string& message) {
  log::Warn({line_.name, std::string(recorder_.NameOf(device))}, "{}", message);
}

void LineReporter::TellState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason, Now at) {
  if (to == DeviceState::disabled || from == DeviceState::disabled) {
    OnNews({News::What::not_in_use, to != DeviceState::disabled, device, reason}, at);
  }
  if (to == DeviceState::offline) {
    OnNews({News::What::no_answer, false, device, reason}, at);
  } else if (Answers(to)) {
    OnNews({News::What::no_answer, true, device}, at);
  }
}

void LineReporter::OnNews(News news, Now at) {
  if (events_ == nullptr || retired_ || news.device >= kFirstSlave) return;
  const auto key = std::pair(news.what, news.device);
  if (news.over) {
    news.first = lasting_.erase(key) == 0;
    const bool known = !over_.insert(key).second;
    if (news.first && known) return;
  } else if (news.what != News::What::replaced) {
    const bool is_new = lasting_.insert(key).second;
    // The trouble of a wrong device may become another one.
    if (!is_new && news.what != News::What::wrong_device) return;
  }
  events_->OnNews(line_, news, at);
}

}  // namespace baudgate
