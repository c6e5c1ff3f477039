// `PointFeed` is the subscriber of `watch`: it passes points, and starts and ends of gateways, from
// the threads of the DDS library to the thread that shows them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/own_network.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/watch/watch.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate::tools {

// `Mailbox` passes items from the threads of the DDS library to the thread that prints. If the
// printing thread is blocked (by a pager) and kMost items wait, Put blocks, and the library stores
// only the latest sample of each instance, so the memory is limited.
template <typename Item>
class Mailbox {
 public:
  Mailbox() = default;
  ~Mailbox() {
    if (wake_ >= 0) ::close(wake_);
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  void Put(Item item) {
    {
      MutexLock lock(mutex_);
      while (!closed_ && items_.size() >= kMost) lock.Wait(room_);
      if (closed_) return;
      items_.push_back(std::move(item));
      if (items_.size() > 1) return;  // the reader was woken for an earlier item
    }
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
  }
  std::vector<Item> TakeAll() {
    const MutexLock lock(mutex_);
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(wake_, &count, sizeof count);
    room_.notify_all();
    return std::exchange(items_, {});
  }
  /// Ends all calls of Put that wait. Put drops items until Reopen is called.
  void Close() {
    const MutexLock lock(mutex_);
    closed_ = true;
    room_.notify_all();
  }
  void Reopen() {
    const MutexLock lock(mutex_);
    closed_ = false;
  }
  /// The descriptor is readable when the mailbox contains an item.
  int descriptor() const { return wake_; }

 private:
  static constexpr std::size_t kMost = 10'000;

  const int wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  Mutex mutex_;
  std::condition_variable room_;
  std::vector<Item> items_ BAUDGATE_GUARDED_BY(mutex_);
  bool closed_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// `Listening` restarts a subscriber that no longer receives: if a network interface was deleted and
// created again, the DDS library receives no more samples.
class Listening {
 public:
  using Open = std::function<Status()>;
  using Find = std::function<dds::OwnAddresses()>;

  /// `open` ends the subscriber, if there is one, and creates a new one. `interfaces`: the network
  /// interfaces of the subscriber.
  Listening(std::vector<std::string> interfaces, Open open, Find find = dds::FindOwnAddresses);

  Status Start();
  /// Checks the interfaces once a second. Returns a message for the user if the subscriber was
  /// restarted or cannot be created. After a failure, tries again each second.
  std::optional<std::string> Look(Instant now);
  Instant next_look() const { return next_look_; }
  /// Returns why there is no subscriber; empty: there is a subscriber.
  const std::optional<std::string>& failure() const { return failure_; }

 private:
  const std::vector<std::string> interfaces_;
  const Open open_;
  const Find find_;
  std::optional<dds::InterfaceWatch> watched_;
  std::optional<std::string> failure_;
  Instant next_look_{};
};

/// Replaces the subscriber; called by `open` of Listening. The mailbox is closed while the old
/// subscriber ends, because a thread of the subscriber may wait in Put and no thread takes items
/// out.
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

struct GatewayStart {
  dds::GatewaySample sample;
  dds::PublisherId publisher;
};
/// A point, the start of a gateway, or the id of a publisher that has ended.
using HeardEvent = std::variant<PointEvent, GatewayStart, dds::PublisherId>;

class PointFeed {
 public:
  explicit PointFeed(dds::ParticipantOptions participant) : participant_(std::move(participant)) {}
  ~PointFeed() { Close(); }
  PointFeed(const PointFeed&) = delete;
  PointFeed& operator=(const PointFeed&) = delete;

  /// Creates the subscriber, in place of an older one.
  Status Open();
  void Close();

  int descriptor() const { return mailbox_.descriptor(); }
  std::vector<HeardEvent> TakeAll() { return mailbox_.TakeAll(); }

  /// Returns the number of samples that could not be decoded.
  std::uint64_t refused() const;
  /// Returns the number of samples that the DDS library dropped because of too many points.
  std::uint64_t rejected() const { return rejected_before_ + rejected_; }

 private:
  dds::SubscriberCallbacks Callbacks();

  const dds::ParticipantOptions participant_;
  Mailbox<HeardEvent> mailbox_;
  std::atomic<std::uint64_t> rejected_ = 0;  // samples that the present subscriber_ has rejected
  std::uint64_t rejected_before_ = 0;
  std::uint64_t refused_before_ = 0;
  std::unique_ptr<dds::DdsSubscriber> subscriber_;
};

// `RunWatchEvents` is `baudgate watch --events` and `--alarms`: it prints one line for each event,
// or for each change of an alarm, of all gateways.

std::string JsonLine(const dds::EventSample& event);
std::string PlainLine(const dds::EventSample& event);
std::string JsonLine(const dds::AlarmSample& alarm);
std::string PlainLine(const dds::AlarmSample& alarm);

/// Returns the exit codes of RunWatch.
int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
