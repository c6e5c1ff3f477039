// The contract of conversations: what one device is asked, and what its answers mean.
// One object per device, made by the protocol's Bus; driven by gateway/poll/poller.h on the line's
// thread. A conversation has no threads, no sockets, no clock of its own and writes no log.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/quality.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "protocols/frame_rule.h"

namespace baudgate {

inline constexpr std::size_t kNoPoint = std::numeric_limits<std::size_t>::max();

/// Points of one group that one request reads together.
struct Query {
  config::Group group = config::Group::fast;
  std::vector<std::size_t> points;  ///< indices into the device's points
};

/// What the line is asked to do for a device until it is done: one exchange, or several.
struct Task {
  enum class Kind : std::uint8_t {
    poll,   ///< read Queries()[query]
    probe,  ///< is it there: one cheap exchange
    write,  ///< write `value` to `point`, then leave the device as it was found
  };
  Kind kind = Kind::poll;
  std::size_t query = 0;
  std::size_t point = kNoPoint;
  Value value;  ///< raw: scale and offset are already taken out
};

struct Request {
  Bytes bytes;  ///< the whole frame, checksum included
  Expectation expect;
  /// Of a probe: the device answers it with the same frame every time, and nothing else with that
  /// frame (an identification). Shows whether answers still belong to what is asked.
  bool steady = false;
  /// Ends what earlier requests of the device have begun, such as an open password: sent whatever
  /// has become of the task, its deadline and its client.
  bool closes = false;
};

/// A value out of a reply, before scale, offset and sentinels.
struct Reading {
  std::size_t point = kNoPoint;
  Value value;  ///< nothing when the quality alone is news
  Quality quality = Quality::good;
  std::string label;  ///< the protocol's own address, only where no point matches (decode)
};

enum class Then : std::uint8_t {
  done,       ///< the task has ended
  ask_again,  ///< call Ask again for the same task: a step of it remains
  replan,     ///< Queries() has changed; the task has ended
};

/// What a frame meant. Of a task of several exchanges the last answer speaks for all: its outcome
/// is the outcome of the task, whatever the closing exchange itself came to.
struct Answer {
  Outcome outcome = Outcome::ok;
  std::string reason;  ///< one sentence for the log when the outcome is not ok
  std::vector<Reading> readings;
  Then then = Then::done;
  Duration wait{};  ///< leave the device in peace so long before it is asked again
};

class Conversation {
 public:
  virtual ~Conversation() = default;

  /// How the device's points are read, in the order of asking. Stable until an Answer or OnFailure
  /// says replan, and until OnReconnect.
  virtual std::span<const Query> Queries() const = 0;

  /// The request to send now for `task`: the task's own, or one that the session needs first (open
  /// a channel, a password). An error ends the task as unsupported with that reason.
  virtual Result<Request> Ask(const Task& task, Instant now) = 0;

  /// A whole frame came for `request`. Check address, function and length first: a frame that does
  /// not fit the request is `unexpected` and gives no readings. At most 8 steps make a task.
  virtual Answer OnFrame(const Task& task, const Request& request, View frame, Instant now) = 0;

  /// The exchange failed for good (retries are used up, it must not be repeated; busy: its time was
  /// over before it was sent). ask_again: a step remains even so, for example closing a password
  /// that may be open.
  virtual Then OnFailure(const Task&, const Request&, Outcome, Instant) { return Then::done; }

  /// What to send in place of a failed request that must not be repeated (SPA: L, then B).
  virtual std::optional<Request> Instead(const Request&, Outcome, Instant) { return std::nullopt; }

  /// The port was opened anew, or the device has just gone silent: sessions are lost, and what was
  /// learned of the device has to be proven again (it may be replaced). Queries() may change.
  virtual void OnReconnect() {}

  /// The meaning of one captured exchange, for `baudgate decode`: the same checks and the same
  /// readings as OnFrame. Values that match no point carry a label instead.
  virtual Answer Interpret(View request, View frame) = 0;
};

}  // namespace baudgate
