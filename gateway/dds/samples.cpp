// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/samples.h"

namespace baudgate::dds {

void AssignBounded(std::string& to, std::string_view text, std::size_t bound) {
  constexpr std::string_view kEllipsis = "\xE2\x80\xA6";
  text = text.substr(0, text.find('\0'));
  if (text.size() <= bound) {
    to.assign(text);
    return;
  }
  std::size_t cut = bound - kEllipsis.size();
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0U) == 0x80U) --cut;
  to.assign(text.substr(0, cut));
  to.append(kEllipsis);
}

}  // namespace baudgate::dds
