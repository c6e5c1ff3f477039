// What may answer a request, for the frame rules. CutTelegram is the frame rule, Recognise says
// what other texts are, and OtherChecksum how a wrong check value may be computed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/matching.h"

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

// Where telegrams begin and end: one rule for every description.

Cut CutTelegram(View held, const Expectation& expect, bool idle);

// What `baudgate ask` needs to know of telegrams that a person sends.

extern const TelegramRule kAskRule;

// How the check value of a telegram may be computed that is wrong as it is described. Pure; used by
// Recognise.

/// `match`: all but its check value is right. Empty: what stands there is no check value.
std::optional<Recognised> OtherChecksum(const Form& form, const Match& match);

// What a text that came in place of an answer may be: one without its check value, without its
// sign, with fewer numbers, or of another form. Pure; for `baudgate status`.

/// An empty request: `heard` came unasked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::telegram
