// SPDX-License-Identifier: Apache-2.0
#include "protocols/example/expect.h"

#include "protocols/example/codec.h"

namespace baudgate::protocols::example {

Expectation Expect(View request) {
  Expectation expect{.max_bytes = kMaxFrame};
  if (const auto message = Decode(request)) {
    expect.address = {static_cast<std::uint8_t>(message->device)};
  }
  return expect;
}

}  // namespace baudgate::protocols::example
