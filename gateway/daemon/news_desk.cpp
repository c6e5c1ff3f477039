// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/news_desk.h"

#include "gateway/trace/tap.h"

namespace baudgate {

void NewsDesk::OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                             const std::string& reason, Now now) {
  if (to == DeviceState::disabled || from == DeviceState::disabled) {
    Tell({News::What::not_in_use, to != DeviceState::disabled, device, reason}, now);
  }
  if (to == DeviceState::offline) {
    Tell({News::What::no_answer, false, device, reason}, now);
  } else if (Answers(to)) {
    Tell({News::What::no_answer, true, device}, now);
  }
}

void NewsDesk::Tell(News news, Now now) {
  if (sink_ == nullptr || news.device >= kFirstSlave) return;
  const auto key = std::pair(news.what, news.device);
  if (news.over) {
    news.first = told_.erase(key) == 0;
    const bool known = !over_.insert(key).second;
    if (news.first && known) return;
  } else if (news.what != News::What::replaced) {
    const bool is_new = told_.insert(key).second;
    // What is wrong with a device may become another thing.
    if (!is_new && news.what != News::What::wrong_device) return;
  }
  sink_->OnNews(line_, news, now);
}

}  // namespace baudgate
