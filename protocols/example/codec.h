// The wire format of the example: how requests and replies are written. Text, one line each:
//   request  ?A7<CR>      read item 7 of device A       ?A0: item 0, the type of the device
//            WA7=5<CR>    write 5 to it
//   reply    !A7=5*0B<CR> its value, or confirms the write; 0B is the low byte of the sum of the
//                         bytes in front of '*', in hex
//            !A7~*17<CR>  refuses: there is no item 7, or it does not take the value
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::example {

inline constexpr std::size_t kMaxFrame = 64;

struct Message {
  char kind = '?';  ///< ? W of requests, ! of replies
  char device = 'A';
  unsigned item = 0;
  std::string content{};  ///< "=5", "~" or empty
};

/// "A" to "Z", nothing else.
Result<char> ParseAddress(std::string_view text);

Bytes EncodeRequest(const Message& request);
Bytes EncodeReply(const Message& reply);

/// A whole frame as the frame rules deliver it; empty: not of this form.
std::optional<Message> Decode(View frame);

}  // namespace baudgate::protocols::example
