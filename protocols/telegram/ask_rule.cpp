// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/ask_rule.h"

#include "protocols/common/settings.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {
namespace {

/// As it was written: a description makes its own telegrams whole.
Result<Bytes> Complete(View written, const Settings&) {
  if (written.empty()) return Error{"a telegram has at least one byte, as in '53 0D 0A'"};
  return Bytes(written.begin(), written.end());
}

bool IsRead(View request, const Settings& settings) {
  const auto& description = settings.description;
  const auto sent = description ? description->Recognise(request) : std::nullopt;
  return sent && description->telegrams[sent->telegram].reads;
}

}  // namespace

const TelegramRule kAskRule = {.complete = kWithSettings<Complete>,
                               .is_read = kWithSettings<IsRead>};

}  // namespace baudgate::protocols::telegram
