// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/status.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::set4tm {
namespace {

StatusMeaning ByCode(std::uint8_t code, bool opening) {
  switch (code) {
    case kOk:
      return {};
    case kNotAllowed:
      return {Outcome::unsupported,
              "the meter does not have this request; the request is not repeated",
              Quality(Quality::bad_configuration, Reason::not_fitted),
              {}};
    case kInternalError:
      return {Outcome::refused, "the meter has an internal error; read its status word (08 0A)",
              Quality(Quality::bad_device_failure, Reason::device_fault), 10s};
    case kLevelTooLow:
      if (opening) {
        return {Outcome::refused, "the meter refuses the password", std::nullopt, {}};
      }
      return {Outcome::refused,
              "the access level of the password is too low for this request; the request is not "
              "repeated",
              Quality(Quality::bad_communication, Reason::no_permission),
              {}};
    case kClockAlreadyCorrected:
      return {Outcome::refused, "the clock was already corrected today", std::nullopt, {}};
    case kChannelClosed:
      return {Outcome::refused,
              "the meter closed the channel right after it was opened; look for another master on "
              "the line",
              std::nullopt, 10s};
    case kRepeat:
      return {Outcome::busy, "the meter asks for the request again", std::nullopt, {}};
    case kNotReady:
      return {Outcome::busy,
              "the result is not ready yet; the last value is kept",
              Quality(Quality::uncertain_last_usable, Reason::not_ready),
              {}};
    case kBusy:
      return {Outcome::busy, "the meter is still busy with an earlier request of this kind",
              std::nullopt, 1s};
    case 0x9:
      return {Outcome::refused, "the payment register has overflowed", std::nullopt, {}};
    case 0xA:
      return {Outcome::refused, "the request cannot be executed", std::nullopt, {}};
    case kMeterSilent:
      return {Outcome::no_reply,
              "the GSM communicator reports that the meter behind it does not answer",
              std::nullopt,
              {}};
    default:
      return {Outcome::refused, "not documented", std::nullopt, 10s};
  }
}

std::string_view RemedyOf(std::uint8_t code) {
  switch (code) {
    case kNotAllowed:
      return "check whether the profile fits this type of meter";
    case kInternalError:
      return "the meter reports a fault; check its display, restart or replace it";
    case kLevelTooLow:
      return "set `password` to the password of a higher level";
    case kChannelClosed:
      return "stop other programs and masters that use the meter";
    case kNotReady:
      return "wait if the meter has just started; else check the voltage at its inputs";
    case kRepeat:
    case kBusy:
      return {};
    case kMeterSilent:
      return "check the meter behind the communicator";
    default:
      return "look the status up in the manual of the meter";
  }
}

}  // namespace

StatusMeaning Explain(std::uint8_t status, bool opening) {
  StatusMeaning meaning = ByCode(CodeOf(status), opening);
  const Duration asked = std::chrono::seconds(status >> 4U);
  meaning.wait = std::max(meaning.wait, asked);
  if (meaning.outcome != Outcome::ok) {
    meaning.reason = "status " + HexByte(status) + ": " + meaning.reason;
    meaning.remedy = RemedyOf(CodeOf(status));
  }
  return meaning;
}

}  // namespace baudgate::protocols::set4tm
