// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/samples.h"

#include "gateway/base/text.h"

namespace baudgate::dds {

void AssignBounded(std::string& to, std::string_view text, std::size_t bound) {
  constexpr std::string_view kEllipsis = "\xE2\x80\xA6";
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  text = text.substr(0, text.find('\0'));
  std::string readable;
  if (auto bad = FirstNotUtf8(text); bad != std::string::npos) {
    for (std::size_t from = 0;; from = bad + 1, bad = FirstNotUtf8(text, from)) {
      readable += text.substr(from, bad - from);
      if (bad == std::string::npos) break;
      readable += kReplacement;
    }
    text = readable;
  }
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
