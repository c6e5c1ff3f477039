// `Identification` checks that the device at the address is the device of the profile. It asks for
// the device's name before the device is polled or written to, until the name is known and right. A
// device that does not answer with a name is asked again at growing intervals. OwnProbe chooses the
// telegram that searches for a silent device.
#pragma once

#include <optional>
#include <vector>

#include "config/model/device.h"
#include "protocols/common/query_plan.h"
#include "protocols/conversation.h"
#include "protocols/telegram/description.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {

/// Returns the telegram that searches for a silent device: the question for the name, or else a
/// telegram that no point reads, that needs no parameters, and whose answer differs in length from
/// all answers to polls. Empty: there is no such telegram, so polls are the probes.
std::optional<std::size_t> OwnProbe(const Description& description,
                                    const std::vector<std::optional<ReadPlace>>& reads,
                                    const Bound& bound);

class Identification {
 public:
  Identification(const Description& description, const config::Identity& identity);

  /// Returns the index of the telegram that asks for the name. Empty: no telegram asks for the
  /// name.
  const std::optional<std::size_t>& telegram() const { return telegram_; }
  bool IsDue(Instant now) const {
    return telegram_ && (!asked_ || trouble_ || nameless_.IsDue(now));
  }
  void OnReply(const Reply& reply);
  /// Call it if the request for the name got no answer with a name. Many devices do not support
  /// this request.
  void OnNoName(Instant now) {
    asked_ = true;
    nameless_.OnRefused(now);
  }
  /// Call it if a request got no answer: a device that has given its name is asked for its name
  /// again.
  void OnLost() { asked_ = asked_ && !named_; }
  void OnReconnect();

  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const Description& description_;
  const config::Identity& identity_;
  const std::optional<std::size_t> telegram_;
  bool asked_ = false;
  bool named_ = false;  // true: the device has given its name since OnReconnect
  // The time when a device that gave no name is asked for its name again. The first interval is
  // long, because many devices ignore this request, which costs a reply time and its retries.
  TryAgain nameless_{10min};
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::telegram
