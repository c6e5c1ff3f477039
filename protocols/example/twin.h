// A device of the example that is not there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/common/twin_points.h"

namespace baudgate::protocols::example {

class ExampleTwin final : public Twin {
 public:
  ExampleTwin(const config::Device& device, TwinValues& values);

  Bytes Answer(View request, Instant now) override;

 private:
  const char address_;
  TwinPoints<unsigned> points_;  ///< by item
};

}  // namespace baudgate::protocols::example
