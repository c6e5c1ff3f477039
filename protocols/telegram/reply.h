// What an answer means, field by field.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "gateway/base/outcome.h"
#include "protocols/common/decoded.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

struct SaidField {
  Decoded decoded{};
  std::string text{};      ///< as it stands there, without the blanks around it
  bool is_status = false;  ///< no number, and has codes: it says how the others are
};

struct Reply {
  Outcome outcome = Outcome::ok;
  /// Of an ok one: what stands where a known code or a number belongs; empty: nothing does.
  std::string reason{};
  std::string remedy{};  ///< goes with the reason of an ok one
  /// What the status fields say of all others.
  Quality quality = Quality::good;
  std::map<std::string, SaidField, std::less<>> fields{};
};

/// `known`: what the answer has to repeat.
Reply DecodeReply(const Telegram& telegram, View frame, const Bound& known);
/// Each number of the match is one, and as wide as described.
bool HasNumbers(const Form& form, const Match& match);

}  // namespace baudgate::protocols::telegram
