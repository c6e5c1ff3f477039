// The wire format of the example protocol. Requests and replies are lines of text:
//
//   request  ?A7<CR>        read item 7 of device A (item 0 is the type of the device)
//            WA7=5<CR>      write 5 to item 7
//   reply    !A7=5*0B<CR>   the value of item 7, or the confirmation of a write
//            !A7~*17<CR>    refusal: there is no item 7, or it does not accept the value
//
// The two hex digits after '*' are the low byte of the sum of the bytes in front of '*'.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::example {

inline constexpr std::size_t kMaxFrame = 64;

struct Message {
  char kind = '?';  ///< '?' or 'W' in requests, '!' in replies
  char device = 'A';
  unsigned item = 0;
  std::string content{};  ///< "=5", "~" or empty
};

Result<char> ParseAddress(std::string_view text);

Bytes EncodeRequest(const Message& request);
Bytes EncodeReply(const Message& reply);

/// Decodes a whole frame that a frame rule has cut. Empty: the frame is malformed.
std::optional<Message> Decode(View frame);

}  // namespace baudgate::protocols::example
