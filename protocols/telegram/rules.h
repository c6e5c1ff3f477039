// Frame rules for described telegrams: `Expect` lists the possible answers, `CutTelegram` is the
// frame rule, `Recognise` explains other texts, and `OtherChecksum` finds how a wrong check value
// may be computed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/matching.h"

namespace baudgate::protocols::telegram {

/// The forms that the frame rule looks for. An expectation carries them.
struct Awaited final : FrameForms {
  std::shared_ptr<const Description> description;  ///< keeps the forms alive
  std::vector<const Form*> forms;
  Bound known;
};

/// Returns the possible answers. An empty request stands for the twin: any telegram that is sent to
/// the device.
Expectation Expect(View request, const Settings& settings);
/// Returns which telegrams the device sends unasked.
Expectation ExpectUnasked(const Settings& settings);

// The frame rule: finds the beginning and the end of telegrams, for every description.

Cut CutTelegram(View held, const Expectation& expect, bool idle);

// The rule for telegrams that a user sends by `baudgate ask`.

extern const TelegramRule kAskRule;

/// Finds how a check value may be computed. `match`: only the check value is wrong. Empty: the text
/// in its place is no check value.
std::optional<Recognised> OtherChecksum(const Form& form, const Match& match);

// Explains a text that came in place of an answer, for `baudgate status`: without its check value,
// without its sign, with fewer numbers, or of another form.

/// An empty request: `heard` came unasked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::telegram
