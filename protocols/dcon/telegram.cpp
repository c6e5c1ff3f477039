// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/telegram.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"
#include "protocols/common/settings.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/identification.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::string_view kLeads = "$#%@~^";
constexpr std::string_view kPlace = "XX";

/// `$01MXX` gives `$01MD2` and CR; so does `$01M` where the module's checksum is on.
Result<Bytes> CompleteCommand(View written, const Settings& settings) {
  std::string text(Trim(AsText(written)));
  if (text.size() < 3 || kLeads.find(text[0]) == std::string_view::npos) {
    return Error{"a DCON command begins with one of $ # % @ ~ ^ and the address, as in '$01M'"};
  }
  const bool printable = std::ranges::all_of(text, [](char c) { return c > 0x20 && c < 0x7F; });
  if (!printable) return Error{"a DCON command has printable characters only, and no blanks"};
  const bool asked_for = text.size() > 4 && text.ends_with(kPlace);
  if (asked_for) text.resize(text.size() - kPlace.size());
  const bool carried = text.size() > 4 && ChecksumFits(text, kChecksum);
  if (asked_for || (settings.checksum && !carried)) {
    text += HexByte(Sum8(ToBytes(text)));
  }
  if (text.size() >= kMaxFrame) return Error{"a DCON command has at most 267 characters"};
  text += '\r';
  return ToBytes(text);
}

bool IsRead(View request, const Settings&) {
  const auto proven = [](const std::optional<Command>& command) {
    return command && !command->broadcast &&
           (command->text == kAskName || command->text == kAskType);
  };
  return proven(ParseRequest(request, false)) || proven(ParseRequest(request, true));
}

}  // namespace

const TelegramRule kTelegram = {kLeads, kWithSettings<CompleteCommand>, kWithSettings<IsRead>};

}  // namespace baudgate::protocols::dcon
