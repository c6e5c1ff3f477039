// What may answer a request, for the frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "protocols/frame_rule.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

/// What the frame rules look for: carried by the expectation, as the shape of a telegram stands in
/// a file.
struct Awaited final : FrameForms {
  std::shared_ptr<const Description> description;  ///< keeps the forms alive
  std::vector<const Form*> forms;
  Bound known;
};

/// An empty request: what is sent to the device.
Expectation Expect(View request, const Settings& settings);
/// What it sends unasked.
Expectation ExpectUnasked(const Settings& settings);

}  // namespace baudgate::protocols::telegram
