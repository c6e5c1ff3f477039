// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/questions.h"

#include <utility>

namespace baudgate::protocols::dcon {
namespace {

/// In one task; beside them come two broadcasts and, of a counter, three reads.
constexpr int kMostQuestions = kMostSteps - 5;

}  // namespace

std::optional<Questions::Question> Questions::TakeAsked() {
  return std::exchange(asked_, std::nullopt);
}

std::optional<Questions::Question> Questions::Before(std::string_view command) {
  asked_ = identification_.Next(command);
  if (!asked_) count_ = 0;
  return asked_;
}

bool Questions::ForgetAnew() { return std::exchange(anew_, std::nullopt).has_value(); }

/// What is due is asked again after the read and not before it: the replies to these questions say
/// whose they are, and only the first request of a task waits for the proof that its reply needs.
Then Questions::AfterRead(std::string_view command, Instant now) {
  anew_.reset();
  if (count_ < kMostQuestions) anew_ = identification_.NextAnew(command, now);
  count_ = anew_ ? count_ + 1 : 0;
  return anew_ ? Then::ask_again : Then::done;
}

Then Questions::AfterQuestion(std::string_view command) {
  const bool goes_on = !identification_.is_done() || identification_.Allows(command);
  // A task has few exchanges: the next poll goes on with the questions, at once.
  const bool enough = ++count_ >= kMostQuestions && goes_on && identification_.Next(command);
  if (goes_on && !enough) return Then::ask_again;
  count_ = 0;
  return enough ? Then::replan : Then::done;
}

void Questions::OnReconnect() {
  asked_.reset();
  anew_.reset();
  count_ = 0;
}

}  // namespace baudgate::protocols::dcon
