// Which telegrams are sent for a task, one after the other: those that go before, the one that is
// meant, those that go behind.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "protocols/telegram/description.h"

namespace baudgate::protocols::telegram {

class Exchanges {
 public:
  /// `description` outlives it.
  explicit Exchanges(const Description& description) : description_(description) {}

  struct Step {
    enum class Part : std::uint8_t { before, meant, behind } part = Part::meant;
    std::size_t telegram = 0;
  };

  void Begin(std::size_t telegram);
  /// Once more from its first telegram on, those that are sent only once as well.
  void BeginAgain();
  bool under_way() const { return at_ < steps_.size(); }
  const Step& step() const { return steps_[at_]; }
  bool is_first() const { return at_ == 0; }
  std::size_t size() const { return steps_.size(); }

  /// The step has succeeded. True: another one follows.
  bool Advance();
  /// It has failed. True: what closes the exchange is still to be sent.
  bool Fail();
  /// What is sent only once is sent again.
  void Forget() { done_once_.clear(); }
  void Break() { at_ = steps_.size(); }

  /// How the telegram that is meant, or the first failure, has ended. The first call counts: the
  /// answer to a closing telegram says nothing of what was meant.
  void EndAs(Outcome outcome, const std::string& reason) {
    if (outcome_ != Outcome::none) return;
    outcome_ = outcome;
    reason_ = reason;
  }
  /// Outcome::none: neither has come yet.
  Outcome outcome() const { return outcome_; }
  const std::string& reason() const { return reason_; }

 private:
  const Description& description_;
  std::vector<Step> steps_;
  std::size_t at_ = 0;
  std::size_t meant_ = 0;
  std::set<std::size_t> done_once_;
  Outcome outcome_ = Outcome::none;
  std::string reason_;
};

}  // namespace baudgate::protocols::telegram
