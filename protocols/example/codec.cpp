// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/codec.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::example {

Result<char> ParseAddress(std::string_view text) {
  if (text.size() == 1 && text[0] >= 'A' && text[0] <= 'Z') return text[0];
  return Error{"'" + std::string(text) + "' is not an address; write one letter, A to Z"};
}

Bytes EncodeRequest(const Message& request) {
  return ToBytes(request.kind + std::string(1, request.device) + std::to_string(request.item) +
                 request.content + "\r");
}

Bytes EncodeReply(const Message& reply) {
  Bytes frame = EncodeRequest(reply);
  frame.pop_back();
  Append(frame, "*" + HexByte(Sum8(frame)) + "\r");
  return frame;
}

std::optional<Message> Decode(View frame) {
  if (frame.size() < 4) return std::nullopt;
  const std::string_view text = AsText(frame);
  const std::size_t end = std::min(text.find('*'), text.size() - 1);
  const std::size_t digits = std::min(text.find_first_not_of("0123456789", 2), end);
  const auto item = ParseInteger<unsigned>(text.substr(2, digits - 2));
  if (!item) return std::nullopt;
  return Message{text[0], text[1], *item, std::string(text.substr(digits, end - digits))};
}

}  // namespace baudgate::protocols::example
