// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/telegram.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"
#include "protocols/common/settings.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

/// `>1RF:`, `>1RF:XX` and `>1RF:21` give `>1RF:21` and CR; XX stays where the device is sent XX.
Result<Bytes> CompleteMessage(View written, const Settings& settings) {
  std::string text(Trim(AsText(written)));
  if (!text.starts_with('>')) return Error{"an SPA telegram begins with '>', as in '>1RF:XX'"};
  const bool printable =
      std::ranges::all_of(text, [](char c) { return IsPrintable(static_cast<std::uint8_t>(c)); });
  if (!printable) return Error{"an SPA telegram has printable characters only"};
  if (text.ends_with(kWildcard)) text.resize(text.size() - kWildcard.size());
  if (text.ends_with(':')) {
    text += settings.send_wildcard ? std::string(kWildcard) : HexByte(Xor8(ToBytes(text)));
  }
  if (text.size() > kMaxLine) return Error{"an SPA telegram has at most 255 characters"};
  text += static_cast<char>(kCr);
  return ToBytes(text);
}

bool IsRead(View request, const Settings&) {
  const ReceivedRequest received = ParseRequest(request);
  return received.intact && received.command && !received.command->write &&
         received.command->slave != kBroadcast && received.command->category != 'L';
}

}  // namespace

const TelegramRule kTelegram = {">", kWithSettings<CompleteMessage>, kWithSettings<IsRead>};

}  // namespace baudgate::protocols::spabus
