// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/writing.h"

#include <algorithm>

#include "protocols/spabus/points.h"
#include "protocols/spabus/reply.h"

namespace baudgate::protocols::spabus {
namespace {

/// True if a read of the point shows what a write has set.
bool IsReadBack(const config::Point& point) {
  return point.access == config::Access::read_write &&
         (point.write.empty() || point.write == point.read);
}

bool IsNext(const Address& item, const Address& before) {
  return item.channel == before.channel && item.category == before.category && item.number &&
         before.number && *item.number == *before.number + 1;
}

/// The maximum number of characters around the values in a write: `>1WS21/23:` and `:CC` CR, with
/// numbers of maximum length.
constexpr std::size_t kMostAround = 28;

}  // namespace

std::vector<PointValue> ValuesOf(const Task& task) {
  std::vector<PointValue> values = {{task.point, task.value}};
  values.insert(values.end(), task.also.begin(), task.also.end());
  return values;
}

Result<Command> WriteOf(unsigned slave, std::span<const PointValue> values,
                        std::span<const config::Point> points) {
  const auto first = WriteAddress(points[values.front().point]);
  if (!first) return Error{first.error()};
  Command command = WriteOf(slave, *first, {});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto text = EncodeValue(values[i].value, points[values[i].point]);
    if (!text) return Error{text.error()};
    if (i > 0) command.data += '/';
    command.data += *text;
  }
  if (command.numbers) command.numbers->last += static_cast<std::uint32_t>(values.size() - 1);
  return command;
}

std::size_t CountTogether(std::span<const PointValue> writes, std::span<const config::Point> points,
                          std::size_t most) {
  std::size_t count = 0;
  std::size_t length = kMostAround;
  Address before;
  for (; count < std::min(writes.size(), most); ++count) {
    const config::Point& point = points[writes[count].point];
    const auto item = WriteAddress(point);
    const auto text = EncodeValue(writes[count].value, point);
    if (!item || !text || !IsReadBack(point)) break;
    if (count > 0 && !IsNext(*item, before)) break;
    length += text->size() + 1;
    if (length > kMaxLine) break;
    before = *item;
  }
  return std::max<std::size_t>(count, std::min<std::size_t>(writes.size(), 1));
}

namespace {

constexpr Address kOpenPassword{0, 'V', 160};
constexpr Address kClosePassword{0, 'V', 161};
/// The maximum number of requests that close the password: one more if the first is not answered.
constexpr int kMostClosings = 2;

bool AreSame(std::span<const PointValue> a, std::span<const PointValue> b) {
  return std::ranges::equal(a, b, [](const PointValue& one, const PointValue& other) {
    return one.point == other.point && one.value == other.value;
  });
}

/// True if the device has read the request to close the password and has refused it. Then it is not
/// repeated: a device also refuses it if nothing is open.
bool IsFinal(const Answer& answer) {
  return answer.outcome == Outcome::refused || answer.outcome == Outcome::unsupported;
}

}  // namespace

Result<Command> WriteSession::Next(unsigned slave, const Task& task,
                                   std::span<const config::Point> points) {
  auto values = ValuesOf(task);
  if (step_ == Step::idle || !AreSame(values, values_)) {
    Reset();
    if (password_refused_) {
      return Error{
          "the device refused the password, which is not sent again, because a few wrong passwords "
          "lock the device; correct `password`, or run 'baudgate enable'"};
    }
    values_ = std::move(values);
    step_ = password_ == 0 ? Step::write : Step::open;
  }
  // All values are checked before the password is opened, so nothing is sent if a value is bad.
  auto write = WriteOf(slave, values_, points);
  if (!write) {
    step_ = Step::idle;
    return write;
  }
  switch (step_) {
    case Step::open:
      maybe_open_ = true;
      closings_ = 0;
      return WriteOf(slave, kOpenPassword, std::to_string(password_));
    case Step::close:
      return WriteOf(slave, kClosePassword, std::to_string(password_));
    default:
      return write;
  }
}

std::optional<Command> WriteSession::Leftover(unsigned slave) {
  // If step_ is not idle, the latest write has ended before the request of this step was sent.
  if (step_ != Step::idle) End();
  if (closings_ >= kMostClosings) return std::nullopt;
  if (unsettled_ && !password_refused_) {
    return WriteOf(slave, kOpenPassword, std::to_string(password_));
  }
  if (!maybe_open_) return std::nullopt;
  return WriteOf(slave, kClosePassword, std::to_string(password_));
}

void WriteSession::OnLeftover(const Answer& answer, std::optional<int> nack) {
  // After an outcome that does not prove life a failure follows, which counts this closing.
  if (ProvesLife(answer.outcome)) ++closings_;
  if (unsettled_) {
    // If the reply to the command that opens the password is neither "ok" nor a NACK, the password
    // may be open. unsettled_ then stays true, so Leftover returns this command again.
    unsettled_ = answer.outcome != Outcome::ok && !nack;
    maybe_open_ = answer.outcome == Outcome::ok;
    password_refused_ = nack && RuleOf(*nack).judged && !RuleOf(*nack).missing;
    if (!unsettled_) closings_ = 0;
    return;
  }
  if (answer.outcome == Outcome::ok || IsFinal(answer)) maybe_open_ = false;
}

Then WriteSession::OnLeftoverFailure(Outcome outcome) {
  if (outcome != Outcome::busy) ++closings_;
  return Then::ask_again;
}

Answer WriteSession::OnAnswer(Answer answer, std::optional<int> nack) {
  switch (step_) {
    case Step::open:
      return Opened(std::move(answer), nack);
    case Step::write:
      answer = Written(std::move(answer), nack);
      result_ = answer;
      if (password_ == 0) {
        step_ = Step::idle;
        return answer;
      }
      step_ = Step::close;
      answer.then = Then::ask_again;
      return answer;
    case Step::close:
      return Closed(std::move(answer));
    case Step::idle:
      break;
  }
  return answer;
}

Answer WriteSession::Opened(Answer answer, std::optional<int> nack) {
  unsettled_ = false;
  if (answer.outcome == Outcome::ok) {
    step_ = Step::write;
    answer.then = Then::ask_again;
  } else if (!nack) {
    // The reply is not from this device, so the password may be open and must be closed.
    result_ = answer;
    step_ = Step::close;
    answer.then = Then::ask_again;
  } else {
    step_ = Step::idle;
    maybe_open_ = false;
    const NackRule& rule = RuleOf(*nack);
    if (rule.judged && rule.missing) {
      answer.outcome = Outcome::refused;
      answer.reason = "the device has no password (" + answer.reason + "); remove `password`";
    } else if (rule.judged) {
      password_refused_ = true;
      answer.outcome = Outcome::refused;
      answer.reason =
          "the device refused the password (" + answer.reason +
          "); the password is sent again only after 'baudgate enable' or with another `password`";
    }
  }
  return answer;
}

/// Returns the answer to the write. A single value that was refused was not stored. After NACK 9,
/// and after NACK 7 of a device with a password, it may be stored later, so the outcome is `busy`.
Answer WriteSession::Written(Answer answer, std::optional<int> nack) const {
  if (!nack || !RuleOf(*nack).judged) return answer;
  if (values_.size() > 1) {
    answer.outcome = Outcome::unexpected;
    answer.reason =
        "several values were written together, and it is not known which of them the device took "
        "(" +
        answer.reason + "); set write_items: 1 to write one value at a time";
  } else if (*nack == kOtherError || (*nack == kNotNow && password_ != 0)) {
    answer.outcome = Outcome::busy;
  }
  return answer;
}

Answer WriteSession::Closed(Answer answer) {
  OnLeftover(answer, std::nullopt);
  if (answer.outcome == Outcome::ok) return Finish({});
  if (!IsFinal(answer) && closings_ < kMostClosings) {
    answer.then = Then::ask_again;
    return answer;
  }
  return Finish("the password may still be open, so close it at the device: " + answer.reason);
}

Answer WriteSession::Finish(const std::string& warning) {
  End();
  Answer answer = std::move(result_);
  result_ = {};
  answer.then = Then::done;
  if (!warning.empty()) {
    answer.reason += (answer.reason.empty() ? "" : "; ") + warning;
  }
  return answer;
}

Then WriteSession::OnFailure(Outcome outcome, bool closes) {
  if (step_ == Step::idle || password_ == 0) {
    End();
    return Then::done;
  }
  if (step_ == Step::open && outcome != Outcome::busy) unsettled_ = false;
  if (step_ == Step::close) {
    if (closes) ++closings_;
    if (closings_ < kMostClosings) return Then::ask_again;
    End();
    return Then::done;
  }
  result_ = {};
  result_.outcome = outcome;
  if (outcome == Outcome::busy) {
    result_.reason = "nothing was written, because the device is busy; write again";
  } else {
    result_.reason = step_ == Step::open
                         ? "the device did not answer the password; nothing was written"
                         : "the device did not answer the write; it may have carried the write out";
  }
  step_ = Step::close;
  return Then::ask_again;
}

/// Ends the task. Closings of this task that got no answer do not count for the next task.
void WriteSession::End() {
  step_ = Step::idle;
  closings_ = 0;
}

void WriteSession::Reset() {
  End();
  values_.clear();
  result_ = {};
}

}  // namespace baudgate::protocols::spabus
