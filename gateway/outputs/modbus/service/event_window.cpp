// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/event_window.h"

namespace baudgate::modbus {

EventBlock EventWindow::Show(std::uint64_t client, std::uint8_t unit,
                             std::optional<events::Source> source) const {
  const auto asked = firsts_.find({client, unit});
  const std::uint32_t first = asked == firsts_.end() ? 0 : asked->second;
  const auto shown =
      events_ ? events_->Show(source, first, kShownEvents) : events::EventFeed::Shown{};
  return EventBlockOf(shown, first);
}

void EventWindow::Forget(std::uint64_t client) {
  std::erase_if(firsts_, [&](const auto& entry) { return entry.first.first == client; });
}

}  // namespace baudgate::modbus
