// What a reader may say, as the frame rule wants it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/frame_rule.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

/// The options of a text as the one Shape of an expectation: its ends in `tag`, `length` and `most`
/// in the lengths. An expectation without a shape: tags.
Shape ShapeOf(const Settings& settings);
/// The same way back.
Settings OfShape(const Shape& shape);

Expectation Expect(View request, const config::Options& options);

}  // namespace baudgate::protocols::reader
