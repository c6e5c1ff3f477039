// Frame rules for described telegrams: `Expect` returns the possible answers, `CutTelegram` is the
// frame rule, `Recognise` explains other texts, and `OtherChecksum` finds how a wrong check value
// may be computed.
#pragma once

#include <memory>
#include <optional>

#include "protocols/frame_rule.h"
#include "protocols/protocol.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/matching.h"

namespace baudgate::protocols::telegram {

/// The forms that the frame rule looks for; a part of the Expectation.
struct Awaited final : FrameForms {
  std::shared_ptr<const Description> description;
  std::vector<const Form*> forms;
  Bound known;
};

/// Returns the possible answers to `request`. For an empty request it returns the forms of all
/// telegrams that are sent to the device, which simulated devices (twins) need.
Expectation Expect(View request, const Settings& settings);
/// Returns the forms of the telegrams that the device sends unasked.
Expectation ExpectUnasked(const Settings& settings);

Cut CutTelegram(View held, const Expectation& expect, bool idle);

extern const TelegramRule kAskRule;

/// Explains the wrong check value of `match`, a telegram without another fault: names the method
/// that gives this value, or else the difference from the value of the profile. Returns nothing if
/// the profile has no check value, or if the text in the field is no number.
std::optional<Recognised> OtherChecksum(const Form& form, const Match& match);

/// Explains `heard`, a text in place of an answer to `request`, for `baudgate status`: it lacks the
/// check value or the sign, has a unit or fewer numbers, or has another form. An empty `request`
/// means that `heard` came unasked.
std::optional<Recognised> Recognise(View request, View heard, const Settings& settings);

}  // namespace baudgate::protocols::telegram
