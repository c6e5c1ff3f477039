// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/relay_identity.h"

#include <algorithm>
#include <string>

#include "protocols/common/designation.h"

namespace baudgate::protocols::spabus {

bool RelayIdentity::WantsName() {
  const bool known = !identity_.ignore && !identity_.names.empty();
  asked_ = known && (!named_ || trouble_);
  return asked_;
}

/// A relay that has no designation contradicts nothing.
Answer RelayIdentity::TakeName(Answer answer) {
  named_ = true;
  const bool was_in_trouble = static_cast<bool>(trouble_);
  const auto name = std::ranges::find_if(answer.readings, [](const Reading& reading) {
    return std::holds_alternative<std::string>(reading.value);
  });
  if (answer.outcome == Outcome::ok && name != answer.readings.end()) {
    trouble_ = JudgeName(identity_, std::get<std::string>(name->value));
  }
  answer = {};
  const bool changed = was_in_trouble != static_cast<bool>(trouble_);
  answer.then = changed ? Then::replan : trouble_ ? Then::done : Then::ask_again;
  return answer;
}

}  // namespace baudgate::protocols::spabus
