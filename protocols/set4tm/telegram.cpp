// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/telegram.h"

#include "protocols/common/settings.h"
#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {
namespace {

/// `C8 08 00` gives the whole frame.
Result<Bytes> CompleteFrame(View written, const Settings& settings) {
  Bytes frame(written.begin(), written.end());
  const Checksum checksum = settings.checksum;
  if (frame.size() < 2 || frame.size() > kMaxData) {
    return Error{"a SET-4TM telegram is an address and a request in hex, as in 'C8 08 00'"};
  }
  // The sum of one byte fits by chance too often.
  const bool whole = checksum == Checksum::crc && frame.size() > 3 && SplitFrame(frame, checksum);
  if (!whole) AppendChecksum(frame, checksum);
  return frame;
}

bool IsReadCode(std::uint8_t code) {
  switch (code) {
    case kLinkTest:
    case kJournal:
    case kEnergy:
    case kMemory:
    case kRead:
    case kJournalExtended:
    case kEnergyExtended:
    case kMemoryTagged:
      return true;
    default:
      return false;
  }
}

bool IsRead(View request, const Settings& settings) {
  const auto parts = SplitFrame(request, settings.checksum);
  if (!parts || parts->address[0] == kBroadcast || !IsReadCode(parts->body[0])) return false;
  const auto length = LengthOfRequest(parts->body);
  return length && length->known && parts->body.size() >= length->min &&
         parts->body.size() <= length->max;
}

}  // namespace

const TelegramRule kTelegram = {"", kWithSettings<CompleteFrame>, kWithSettings<IsRead>};

}  // namespace baudgate::protocols::set4tm
