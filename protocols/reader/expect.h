// What a reader may say, as the frame rule wants it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/options.h"
#include "protocols/frame_rule.h"
#include "protocols/reader/settings.h"

namespace baudgate::protocols::reader {

/// The options of a text as the one Shape of an expectation: its ends in `tag`, `length` and `most`
/// in the lengths. An expectation without a shape: tags, and else there is nothing on the line.
Shape ShapeOf(const Settings& settings);
/// The same way back.
Settings OfShape(const Shape& shape);

/// Tags of a reader that answers commands: what is no tag may be of an answer.
inline constexpr int kTagsAndAnswers = -1;
/// The answer to Command::information.
inline constexpr int kInformation = -2;

Expectation Expect(View request, const Settings& settings);

}  // namespace baudgate::protocols::reader
