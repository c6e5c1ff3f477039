// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/nack.h"

namespace baudgate::protocols::spabus {
namespace {

// Arcteq's table of SPA error codes; what to do is ours (README.md).
constexpr NackRule kRules[] = {
    {Outcome::corrupt,
     "the device saw a checksum or parity error; check wiring, termination and bit rate",
     "requests reach it damaged: check wiring and termination",
     {},
     false,
     false,
     false},
    {Outcome::busy, "the device is busy; it will be asked again", "", 1s, false, false, false},
    {Outcome::busy, "the input buffer of the device is full; a lower max_items or bit rate helps",
     "restart it, or set a lower bit rate", 200ms, false, false, false},
    {Outcome::unsupported,
     "the request is too complicated for the device; it will be asked for fewer items at a time",
     "set max_items: 1 in the configuration",
     {},
     true,
     true},
    {Outcome::refused, "a code of higher network levels; look at the gateway in between",
     "look at the gateway in between"},
    {Outcome::unsupported,
     "the device does not understand the address; check category and number in the profile",
     "does the profile fit the device? It does not have these items: correct them, or take them "
     "out",
     {},
     true,
     true},
    {Outcome::unsupported,
     "the device does not have this item; check the profile against its manual",
     "does the profile fit the device? It does not have these items: correct them, or take them "
     "out",
     {},
     true,
     true},
    {Outcome::refused,
     "the item cannot be read or written now; it may be blocked, read-only, write-only or behind "
     "a password",
     "is it in test or local mode, or does it want a password?",
     {},
     true},
    {Outcome::refused, "the device does not accept the value; check its setting range",
     "check the setting range of the device"},
    {Outcome::refused, "the device reports an error of another kind", "look at the device"},
};
constexpr NackRule kUnknown{Outcome::refused, "the meaning of this code is not known",
                            "look it up in the manual of the device"};

}  // namespace

const NackRule& RuleOf(int code) {
  if (code < 0 || code > 9) return kUnknown;
  return kRules[code];
}

std::string Explain(int code) {
  return "NACK " + std::to_string(code) + ": " + std::string(RuleOf(code).meaning);
}

}  // namespace baudgate::protocols::spabus
