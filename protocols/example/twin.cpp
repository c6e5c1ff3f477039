// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/twin.h"

#include "protocols/example/points.h"

namespace baudgate::protocols::example {

ExampleTwin::ExampleTwin(const config::Device& device, TwinValues& values)
    : address_(ParseAddress(device.address).value()),
      points_(device, values, ParseItem, ParseItem) {}

Bytes ExampleTwin::Answer(View request, Instant now) {
  const auto asked = Decode(request);
  if (!asked || asked->device != address_) return {};
  Message reply{'!', reply_as_, asked->item, "~"};
  const auto is_asked = [&](unsigned item) { return item == asked->item; };
  if (asked->item == 0) {
    reply.content = "=1";  // the device type
  } else if (asked->kind == 'W') {
    const auto* point = points_.FindWritable(is_asked);
    const auto [value, quality] = DecodeValue(asked->content);
    if (point != nullptr && IsGood(quality)) {
      points_.Set(*point, value);
      reply.content = asked->content;
    }
  } else if (const auto* point = points_.Find(is_asked)) {
    reply.content = EncodeValue(points_.Get(*point, now));
  }
  return EncodeReply(reply);
}

}  // namespace baudgate::protocols::example
