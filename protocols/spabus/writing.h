// Writes items: one item with its value, or neighbouring items with their values.
//   V150 ← 1                       >1WV150:1:
//   S21 ← 0.5, S22 ← 1.2, S23 ← 3  >1WS21/23:0.5/1.2/3:
//
// `WriteSession` decides the steps of one write.
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

std::vector<PointValue> ValuesOf(const Task& task);

/// Returns the request that writes `values`: one value, or several if CountTogether allows them in
/// one request. The error names the value that does not fit its point.
Result<Command> WriteOf(unsigned slave, std::span<const PointValue> values,
                        std::span<const config::Point> points);

/// Returns how many of `writes`, from the first on, fit into one request: at least one, at most
/// `most`. They must be neighbouring items of one channel and category that can be read back, and
/// fit into one line.
std::size_t CountTogether(std::span<const PointValue> writes, std::span<const config::Point> points,
                          std::size_t most);

/// The steps of one write: open the password, write, close the password, also after a failure. An
/// open password opens the relay for every master on the line, and a few wrong passwords lock the
/// relay. So the password is sent only for a real write, and never again after a refusal. It is
/// closed with its own value: any other value in V161 would become the new password.
class WriteSession {
 public:
  /// `password`: the password of the device; 0: the device needs none.
  explicit WriteSession(std::int64_t password) : password_(password) {}

  Result<Command> Next(unsigned slave, const Task& task, std::span<const config::Point> points);
  /// True if the latest command opens the password, so it writes no value.
  bool opening() const { return step_ == Step::open; }
  bool closing() const { return step_ == Step::close; }

  /// Handles the decoded reply to the current step. Returns the answer of the task; in the last
  /// step the answer contains the outcome of the write itself.
  Answer OnAnswer(Answer answer, std::optional<int> nack);
  /// Handles a failed exchange. OnAnswer may have been called before with a frame that was no good
  /// reply. `closes`: true if the request should have closed the password.
  Then OnFailure(Outcome outcome, bool closes);

  /// Returns the command that closes a password that an earlier task has left open; after
  /// OnUnsettledWrite, first the command that opens the password. Empty: no password is open, or
  /// kMostClosings commands were sent in vain. Call it before each read of a device that answers,
  /// because the next write may be far away. The call itself is not counted, because its request
  /// may wait and be made again.
  std::optional<Command> Leftover(unsigned slave);
  void OnLeftover(const Answer& answer, std::optional<int> nack);
  Then OnLeftoverFailure(Outcome outcome);

  /// Call it if the program was killed during a write, so the password may be open. The password is
  /// closed only if the device accepts the configured password: in another device the closing would
  /// set a new password.
  void OnUnsettledWrite() { unsettled_ = password_ != 0; }
  /// True if the password may be open. The caller stores this over restarts, because the device may
  /// be silent until then.
  bool may_be_open() const { return unsettled_ || maybe_open_; }

  /// Call it when a user has enabled the device again: a refused password is then sent once more.
  void OnEnabled() { password_refused_ = false; }

  /// Forgets the current task, but not that the password may be open. A refused password stays
  /// refused: it is wrong until the configuration changes, and a device that comes and goes must
  /// not collect the attempts that lock it.
  void Reset();

 private:
  enum class Step : std::uint8_t { idle, open, write, close };

  Answer Opened(Answer answer, std::optional<int> nack);
  Answer Written(Answer answer, std::optional<int> nack) const;
  Answer Closed(Answer answer);
  Answer Finish(const std::string& warning);
  void End();

  std::int64_t password_;
  Step step_ = Step::idle;  ///< the step that the next command makes
  std::vector<PointValue> values_;
  Answer result_;
  /// How many requests to close the password have ended in a row, with or without an answer.
  int closings_ = 0;
  bool password_refused_ = false;
  bool maybe_open_ = false;  ///< true: the password was sent, and no closing was answered since
  bool unsettled_ = false;   ///< true: a write before a restart may have left the password open
};

}  // namespace baudgate::protocols::spabus
