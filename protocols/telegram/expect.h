// What may answer a request, for the frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/model/options.h"
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

/// Of an empty request: what is sent to the device.
Expectation Expect(View request, const config::Options& options);
/// What it sends unasked.
Expectation ExpectUnasked(const config::Options& options);

}  // namespace baudgate::protocols::telegram
