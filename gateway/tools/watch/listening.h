// Keeps a subscriber that hears. An interface that was deleted and made again leaves the library
// deaf, so the subscriber is then made again, as the gateway does with its own participant.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/fast/interface_watch.h"
#include "gateway/tools/watch/mailbox.h"

namespace baudgate {

class Listening {
 public:
  using Open = std::function<Status()>;
  using Find = std::function<dds::OwnAddresses()>;

  /// `open` ends the subscriber, if there is one, and makes it again. `interfaces`: those of its
  /// participant.
  Listening(std::vector<std::string> interfaces, Open open, Find find = dds::FindOwnAddresses);

  /// The first time.
  Status Start();
  /// Looks once a second. Returns what people are to know: that it was started again, or why it
  /// cannot be. Then it is tried again each second.
  std::optional<std::string> Look(Instant now);
  Instant next_look() const { return next_look_; }
  /// Why there is no subscriber now.
  const std::optional<std::string>& failure() const { return failure_; }

 private:
  const std::vector<std::string> interfaces_;
  const Open open_;
  const Find find_;
  std::optional<dds::InterfaceWatch> watched_;
  std::optional<std::string> failure_;
  Instant next_look_{};
};

/// For `open`. The mailbox is closed meanwhile: a thread of the old subscriber may wait there for
/// room, and nothing is taken out.
template <typename Subscriber, typename Item, typename Make>
Status MakeAnew(std::unique_ptr<Subscriber>& subscriber, Mailbox<Item>& mailbox, const Make& make) {
  mailbox.Close();
  subscriber.reset();
  mailbox.Reopen();
  auto made = make();
  if (!made) return Error{made.error()};
  subscriber = std::move(*made);
  return {};
}

}  // namespace baudgate
