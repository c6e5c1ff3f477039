// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/by_hand.h"

#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {
namespace {

/// As it was written: a description makes its own telegrams whole.
Result<Bytes> Complete(View written, const config::Options&) {
  if (written.empty()) return Error{"a telegram has at least one byte, as in '53 0D 0A'"};
  return Bytes(written.begin(), written.end());
}

bool IsRead(View request, const config::Options& options) {
  const auto description = DescriptionOf(options);
  const auto sent = description ? description->Recognise(request) : std::nullopt;
  return sent && description->telegrams[sent->telegram].reads;
}

}  // namespace

const TelegramRule kByHand = {.complete = Complete, .is_read = IsRead};

}  // namespace baudgate::protocols::telegram
