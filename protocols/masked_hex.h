// A request as users may see it: in hex, with `**` in place of secret bytes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "gateway/base/text.h"
#include "protocols/frame_rule.h"

namespace baudgate {

/// `expect`: of this request. "3E 31 57 ** ** 0D".
inline std::string MaskedHex(View request, const Expectation& expect) {
  std::string text;
  for (std::size_t i = 0; i < request.size(); ++i) {
    const bool secret = std::ranges::any_of(expect.secrets, [i](const auto& range) {
      return i >= range.first && i - range.first < range.second;
    });
    text += (text.empty() ? "" : " ") + (secret ? std::string("**") : HexByte(request[i]));
  }
  return text;
}

}  // namespace baudgate
