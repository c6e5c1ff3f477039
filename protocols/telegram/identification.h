// `Identification` checks that the device at the address is the device of the profile. The device
// is asked for its name before it is polled or written to, until the name is known and right. A
// device that does not answer with a name is asked again at growing intervals. OwnProbe chooses the
// telegram that searches for a silent device.
// SPDX-License-Identifier: Apache-2.0
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
/// all answers to polls. Empty: polls are the probes.
std::optional<std::size_t> OwnProbe(const Description& description,
                                    const std::vector<std::optional<ReadPlace>>& reads,
                                    const Bound& bound);

class Identification {
 public:
  /// The references must outlive this object.
  Identification(const Description& description, const config::Identity& identity);

  /// Empty: no telegram asks for the name.
  const std::optional<std::size_t>& telegram() const { return telegram_; }
  bool IsDue(Instant now) const {
    return telegram_ && (!asked_ || trouble_ || nameless_.IsDue(now));
  }
  void OnReply(const Reply& reply);
  /// The telegram got no answer with a name. Many devices do not support the question.
  void OnNoName(Instant now) {
    asked_ = true;
    nameless_.OnRefused(now);
  }
  /// A request got no answer: a device that has given its name is asked for it again.
  void OnLost() { asked_ = asked_ && !named_; }
  /// Another device may answer next.
  void OnReconnect();

  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const Description& description_;
  const config::Identity& identity_;
  const std::optional<std::size_t> telegram_;
  bool asked_ = false;
  bool named_ = false;  // the device has given its name since OnReconnect
  // When a device that gave no name is asked again. The interval is long, because many devices
  // ignore the question, which costs a reply time and its retries.
  TryAgain nameless_{10min};
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::telegram
