// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/settings.h"

#include <algorithm>
#include <array>

#include "gateway/base/spelling.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::size_t kLongestAddress = 32;

constexpr std::array<OptionSpec, 3> kOptions = {
    {option::Described(kTelegramsOption,
                       "What is sent to the device and what it answers; mostly in its profile."),
     option::Pairs(kParametersOption, "",
                   "Values of fields of its telegrams, such as { channel: 2 }."),
     option::Secret(option::Text("password", "", "The field {password} of its telegrams."))}};

}  // namespace

std::span<const OptionSpec> OptionTable() { return kOptions; }

Result<std::string> CanonicalAddress(std::string_view address) {
  if (address.empty()) return std::string(kNoAddress);
  const bool usable = address.size() <= kLongestAddress && std::ranges::all_of(address, [](char c) {
                        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                               (c >= 'A' && c <= 'Z') || c == '-' || c == '_' || c == '.';
                      });
  if (!usable) {
    return Error{config::Quoted(address) +
                 " is no address: a number, hex as 0x4A, or a word of letters and digits"};
  }
  return ToText(AddressValue(address));
}

}  // namespace baudgate::protocols::telegram
