// Cuts SET-4TM requests and replies by their known length and checksum.
//
//   > C8 | 08 1B 00 11 | 77 BB                   address 200: voltage of phase 1 as a float
//   < C8 | 00 80 66 43 | AE 69                   230.5 V
//   < C8 | 05 | CRC                              status 5 in its place: channel not open
//   > FC 00 89 A2 61 | 08 00 | 8F 76             extended address 9020001: serial number
//   < FC 00 89 A2 61 | 00 89 A2 61 06 09 02 | 58 BB
//
// The silence that ends a frame (8 ms at 9600) does not survive USB adapters and serial servers.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/frame_rule.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::size_t kStatusBody = 1;

Checksum ChecksumOf(const Expectation& expect) { return static_cast<Checksum>(expect.checksum); }

/// CRC-16 has no final XOR: a good frame followed by zeros (a break on the line) has a good CRC
/// too, and a good KS. A status so lengthened must not be read as data.
bool IsStatusAndZeros(View frame, Checksum checksum) {
  const std::size_t status = AddressLength(frame[0]) + kStatusBody + SizeOf(checksum);
  return frame.size() > status && EndsInChecksum(frame.first(status), checksum) &&
         std::ranges::all_of(frame.subspan(status), [](std::uint8_t byte) { return byte == 0; });
}

/// A short address is the meter's own; whose an extended one is, the conversation knows.
bool IsFromAnother(View frame, const Expectation& expect) {
  if (frame[0] == kExtendedPrefix || expect.address.size() != 1) return false;
  return frame[0] != expect.address[0] && expect.address[0] != kCommonAddress;
}

}  // namespace

// The code (and its parameter) gives the length; a few parameters take an optional byte, then the
// shorter form with a good CRC wins. Codes that are not listed are whole only before silence.
Cut RequestRule(View held, const Expectation& expect, bool idle) {
  const Checksum checksum = ChecksumOf(expect);
  const std::size_t tail = SizeOf(checksum);
  const std::size_t head = AddressLength(held[0]);
  const auto length =
      held.size() > head ? LengthOfRequest(held.subspan(head)) : std::optional<RequestLength>();
  if (length) {
    const std::size_t most = head + length->max + tail;
    if (length->known) {
      const std::size_t limit = std::min(most, held.size());
      for (std::size_t size = head + length->min + tail; size <= limit; ++size) {
        if (EndsInChecksum(held.first(size), checksum)) return Cut::Frame(size);
      }
    } else if (idle && held.size() >= head + length->min + tail && held.size() <= most &&
               EndsInChecksum(held, checksum)) {
      return Cut::Frame(held.size());
    }
    if (held.size() >= most) return cut::BadChecksum();
  }
  return cut::Wait(idle);
}

// A reply repeats nothing of its request. The longest expected length with a good CRC is whole at
// once. Anything else only when silence follows, because the first bytes of data may have a good
// CRC by chance: the status where data is awaited, or a late reply to another request, which the
// conversation tells by its length.
Cut ReplyRule(View held, const Expectation& expect, bool idle) {
  const Checksum checksum = ChecksumOf(expect);
  const int form = held[0] == kExtendedPrefix ? kExtendedForm : kShortForm;
  std::size_t longest = 0;
  for (const Shape& shape : expect.shapes) {
    if (shape.tag == form) longest = std::max(longest, shape.max_length);
  }
  if (longest == 0) return Cut::Discard(1, Outcome::corrupt, "no such reply is awaited");
  const bool another = IsFromAnother(held, expect);
  const auto whole = [another](std::size_t size) {
    return another ? cut::OfAnother(size) : Cut::Frame(size);
  };
  if (held.size() >= longest && EndsInChecksum(held.first(longest), checksum)) {
    if (!IsStatusAndZeros(held.first(longest), checksum)) return whole(longest);
    return Cut::Discard(1, Outcome::corrupt, "status and zeros cannot be told from data");
  }
  if (another && held.size() >= longest) return cut::BadChecksum();
  if (!idle) return Cut::NeedMore();
  const std::size_t shortest = AddressLength(held[0]) + kStatusBody + SizeOf(checksum);
  if (held.size() >= shortest && EndsInChecksum(held, checksum)) return whole(held.size());
  return held.size() >= longest ? cut::BadChecksum() : cut::Wait(idle);
}

}  // namespace baudgate::protocols::set4tm
