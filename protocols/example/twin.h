// `ExampleTwin` simulates a device of the example protocol.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/common/twin_points.h"
#include "protocols/example/codec.h"

namespace baudgate::protocols::example {

class ExampleTwin final : public Twin {
 public:
  ExampleTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;
  void ReplyAs(std::string_view address) override { reply_as_ = ParseAddress(address).value(); }

 private:
  const char address_;
  char reply_as_ = address_;
  TwinPoints<unsigned> points_;
};

}  // namespace baudgate::protocols::example
