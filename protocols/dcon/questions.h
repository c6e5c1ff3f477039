// When the questions of a module's identification are asked: before the first command of a task,
// and again behind its read. A task has few exchanges, so the questions of a round may take several
// tasks.
//
//   Before("#")   $M   then $2   then nothing: "#" may go out
//   AfterRead     $2   it is time to ask again whether it is still the same module
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "protocols/conversation.h"
#include "protocols/dcon/identification.h"

namespace baudgate::protocols::dcon {

class Questions {
 public:
  using Question = Identification::Question;

  /// It outlives this.
  explicit Questions(Identification& identification) : identification_(identification) {}

  /// The request under way asks this; empty: it is the task's own.
  const std::optional<Question>& asked() const { return asked_; }
  void SetAsked(std::optional<Question> question) { asked_ = question; }
  /// The same, and it is answered or has failed.
  std::optional<Question> TakeAsked();

  /// What has to be asked before `command`; empty: it may go out.
  std::optional<Question> Before(std::string_view command);
  /// What is to be asked after the read of the task under way; empty: the task is over.
  const std::optional<Question>& anew() const { return anew_; }
  /// The task has failed. True: it was behind its read.
  bool ForgetAnew();
  /// The next round of questions begins with a fresh count.
  void ForgetCount() { count_ = 0; }

  /// How a task goes on behind its read.
  Then AfterRead(std::string_view command, Instant now);
  /// How a task that wants to send `command` goes on behind a question.
  Then AfterQuestion(std::string_view command);
  void OnReconnect();

 private:
  Identification& identification_;
  std::optional<Question> asked_;
  std::optional<Question> anew_;
  int count_ = 0;  ///< in the task under way
};

}  // namespace baudgate::protocols::dcon
