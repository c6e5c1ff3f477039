// What one write request carries: one item with its value, or neighbouring items with theirs.
//   V150 ← 1                       >1WV150:1:
//   S21 ← 0.5, S22 ← 1.2, S23 ← 3  >1WS21/23:0.5/1.2/3:
// Points and values come from tasks; commands go to the conversation.
//
// WriteSession has the steps of one write.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"

namespace baudgate::protocols::spabus {

/// What a write is for: the task's own value, then those that go with it.
std::vector<PointValue> ValuesOf(const Task& task);

/// The request that writes `values`, which CountTogether has passed, or one alone. An error names
/// the value that does not fit its point.
Result<Command> WriteOf(unsigned slave, std::span<const PointValue> values,
                        std::span<const config::Point> points);

/// How many of `writes`, from the first on, stand side by side in one channel and category, can be
/// read back, and fit one line; at most `most`, at least one.
std::size_t CountTogether(std::span<const PointValue> writes, std::span<const config::Point> points,
                          std::size_t most);

// The steps of one write: open the password, write, close the password again, whatever happened.
// Values come from tasks; commands go to the conversation, which puts them on the wire.

/// A password opens the relay for everybody on the line and a few wrong ones lock it out. So it is
/// sent for a real write only, never again after the device has refused it, and closed with its own
/// value: any other value written to V161 would become the new password.
class WriteSession {
 public:
  /// `password` 0 = the device needs none.
  explicit WriteSession(std::int64_t password) : password_(password) {}

  /// The command of the step that is due for `task`, which writes points of `points`.
  Result<Command> Next(unsigned slave, const Task& task, std::span<const config::Point> points);
  /// Whether the command just given opens the password: nothing is written by it.
  bool opening() const { return step_ == Step::open; }
  /// Whether the command just given closes the password.
  bool closing() const { return step_ == Step::close; }

  /// Takes the decoded answer to the step in hand. The answer of the last step carries the outcome
  /// of the write itself.
  Answer OnAnswer(Answer answer, std::optional<int> nack);
  /// The exchange failed, be it in silence or after OnAnswer had called its frame no good.
  /// `closes`: its request should have closed the password.
  Then OnFailure(Outcome outcome, bool closes);

  /// Closes what an earlier task has left open; nothing when nothing is, or the most closings have
  /// got no answer. Asking alone counts nothing: the request may wait, and then be asked for again.
  /// For a device that answers: before it is read, as no write may come for a long time.
  /// Behind OnUnsettledWrite it opens the password first.
  std::optional<Command> Leftover(unsigned slave);
  void OnLeftover(const Answer& answer, std::optional<int> nack);
  Then OnLeftoverFailure(Outcome outcome);

  /// The program was killed within a write: its password may be open. Only a device that takes the
  /// configured password is closed with it: in another one it would become the new password.
  void OnUnsettledWrite() { unsettled_ = password_ != 0; }
  /// Its password may be open. Worth keeping over restarts: the device may be silent until then.
  bool may_be_open() const { return unsettled_ || maybe_open_; }

  /// A person has looked: a refused password may be sent once more.
  void OnEnabled() { password_refused_ = false; }

  /// Forgets the task in hand, not that its password may be open. A refused password stays refused:
  /// it is wrong until the configuration changes, and a device that comes and goes must not add up
  /// the attempts that lock it.
  void Reset();

 private:
  enum class Step : std::uint8_t { idle, open, write, close };

  Answer Opened(Answer answer, std::optional<int> nack);
  Answer Written(Answer answer, std::optional<int> nack) const;
  Answer Closed(Answer answer);
  /// The final answer of the task.
  Answer Finish(const std::string& warning);
  void End();

  std::int64_t password_;
  Step step_ = Step::idle;          ///< due next
  std::vector<PointValue> values_;  ///< of the task in hand
  Answer result_;                   ///< of the write itself
  int closings_ = 0;                ///< in a row that have come to an end, by an answer or without
  bool password_refused_ = false;
  bool maybe_open_ = false;  ///< the password was sent, and no closing was answered since
  bool unsettled_ = false;   ///< a write before a restart may have left it open
};

}  // namespace baudgate::protocols::spabus
