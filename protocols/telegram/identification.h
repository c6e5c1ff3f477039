// Finds out whether the device at the address is the one of the profile. Before it is polled or
// written to, the device is asked for its name: until the name is known, and as long as it is that
// of another device. One that does not tell it is asked again less and less often. IdentityTelegram
// and OwnProbe choose the telegram for a silent device.
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

// Which telegram a silent device is looked for with.

/// The same, or else one that no point reads, needs no parameters, and is answered with a length
/// that no poll's answer has. Empty: there is none, and polls are the probes.
std::optional<std::size_t> OwnProbe(const Description& description,
                                    const std::vector<std::optional<ReadPlace>>& reads,
                                    const Bound& bound);

class Identification {
 public:
  /// Both outlive it.
  Identification(const Description& description, const config::Identity& identity);

  /// The telegram that asks for the name; empty: there is none.
  const std::optional<std::size_t>& telegram() const { return telegram_; }
  bool IsDue(Instant now) const {
    return telegram_ && (!asked_ || trouble_ || nameless_.IsDue(now));
  }
  /// Its answer.
  void OnReply(const Reply& reply);
  /// It got no answer with a name. Many devices of a kind do not know the question.
  void OnNoName(Instant now) {
    asked_ = true;
    nameless_.OnRefused(now);
  }
  /// A request got no answer: one that has a name is asked for it again.
  void OnLost() { asked_ = asked_ && !named_; }
  /// Another device may answer next.
  void OnReconnect();

  const DeviceTrouble& trouble() const { return trouble_; }

 private:
  const Description& description_;
  const config::Identity& identity_;
  const std::optional<std::size_t> telegram_;
  bool asked_ = false;
  bool named_ = false;  // it has told its name, since OnReconnect
  // When one that does not tell its name is asked again. Rarely: many are silent to the question,
  // which costs a reply time and its repetitions.
  TryAgain nameless_{10min};
  DeviceTrouble trouble_;
};

}  // namespace baudgate::protocols::telegram
