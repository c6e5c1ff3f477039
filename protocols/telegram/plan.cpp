// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/plan.h"

namespace baudgate::protocols::telegram {

void Exchanges::Begin(std::size_t telegram) {
  const Telegram& meant = description_.telegrams[telegram];
  steps_.clear();
  meant_ = telegram;
  at_ = 0;
  outcome_ = Outcome::none;
  reason_.clear();
  for (const std::size_t one : meant.before) {
    if (done_once_.contains(one)) continue;
    steps_.push_back({Step::Part::before, one});
  }
  steps_.push_back({Step::Part::meant, telegram});
  for (const std::size_t one : meant.behind) steps_.push_back({Step::Part::behind, one});
}

void Exchanges::BeginAgain() {
  Forget();
  Begin(meant_);
}

bool Exchanges::Advance() {
  if (!under_way()) return false;
  const Step& done = steps_[at_];
  if (description_.telegrams[done.telegram].once) done_once_.insert(done.telegram);
  ++at_;
  return under_way();
}

bool Exchanges::Fail() {
  Forget();
  // What was not begun has nothing to be closed.
  const bool begun = at_ > 0 || (under_way() && steps_[at_].part != Step::Part::before);
  while (under_way() && steps_[at_].part != Step::Part::behind) ++at_;
  const bool closes = begun && under_way() && steps_[at_].part == Step::Part::behind;
  if (!closes) Break();
  return closes;
}

}  // namespace baudgate::protocols::telegram
