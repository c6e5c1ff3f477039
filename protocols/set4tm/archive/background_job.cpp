// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/background_job.h"

#include "gateway/base/text.h"

namespace baudgate::protocols::set4tm {

std::string KeptParts::Text() const {
  std::string text = std::to_string(meter) + ' ';
  for (const Part& part : parts) {
    if (&part != &parts.front()) text += ';';
    text += part.name + ':' + part.text;
  }
  return text;
}

std::optional<KeptParts> KeptParts::Parse(std::string_view said) {
  const auto head = said.find(' ');
  if (head == std::string_view::npos) return std::nullopt;
  const auto meter = ParseInteger<std::uint32_t>(said.substr(0, head));
  if (!meter) return std::nullopt;
  KeptParts kept{.meter = *meter};
  for (const std::string_view part : Split(said.substr(head + 1), ';')) {
    const auto colon = part.find(':');
    if (colon == std::string_view::npos) continue;
    kept.parts.push_back({std::string(part.substr(0, colon)), std::string(part.substr(colon + 1))});
  }
  return kept;
}

bool KeptMeter::OnKept(std::uint32_t meter) {
  kept_ = meter != 0 ? std::optional(meter) : std::nullopt;
  return kept_ && serial_ && *kept_ != *serial_;
}

bool KeptMeter::OnMeter(std::uint32_t serial) {
  serial_ = serial;
  if (!kept_ || *kept_ == serial) return false;
  kept_.reset();
  return true;
}

}  // namespace baudgate::protocols::set4tm
