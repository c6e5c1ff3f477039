// The subscriber of `watch`: points, starts and ends of gateways on their way from the library's
// threads to the one that shows them. Mailbox holds what comes, and Listening keeps a subscriber
// that hears. RunWatchEvents prints events and alarms.
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

// What comes on the DDS library's threads, for the one that prints. While that one is stuck (a
// pager) Put waits, and the library keeps only the latest of each instance: memory stays bounded.
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
      if (items_.size() > 1) return;  // the reader has been woken already
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
  /// Nothing waits in Put from now on, and what is put is dropped.
  void Close() {
    const MutexLock lock(mutex_);
    closed_ = true;
    room_.notify_all();
  }
  void Reopen() {
    const MutexLock lock(mutex_);
    closed_ = false;
  }
  /// Readable when something is in it.
  int descriptor() const { return wake_; }

 private:
  static constexpr std::size_t kMost = 10'000;

  const int wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  Mutex mutex_;
  std::condition_variable room_;
  std::vector<Item> items_ BAUDGATE_GUARDED_BY(mutex_);
  bool closed_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// Keeps a subscriber that hears. An interface that was deleted and made again leaves the library
// deaf, so the subscriber is then made again, as the gateway does with its own participant.
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

struct GatewayStart {
  dds::GatewaySample sample;
  dds::PublisherId publisher;
};
using HeardEvent = std::variant<PointEvent, GatewayStart, dds::PublisherId>;  ///< the last has left

class PointFeed {
 public:
  explicit PointFeed(dds::ParticipantOptions participant) : participant_(std::move(participant)) {}
  ~PointFeed() { Close(); }
  PointFeed(const PointFeed&) = delete;
  PointFeed& operator=(const PointFeed&) = delete;

  /// With another subscriber when there is one.
  Status Open();
  void Close();

  /// Readable when there is something to take.
  int descriptor() const { return mailbox_.descriptor(); }
  std::vector<HeardEvent> TakeAll() { return mailbox_.TakeAll(); }

  /// Samples so far that could not be read.
  std::uint64_t refused() const;
  /// Samples so far of points for which there was no room.
  std::uint64_t rejected() const { return rejected_before_ + rejected_; }

 private:
  dds::SubscriberCallbacks Callbacks();

  const dds::ParticipantOptions participant_;
  Mailbox<HeardEvent> mailbox_;
  std::atomic<std::uint64_t> rejected_ = 0;  ///< by this subscriber
  std::uint64_t rejected_before_ = 0;
  std::uint64_t refused_before_ = 0;
  std::unique_ptr<dds::DdsSubscriber> subscriber_;
};

// `baudgate watch --events`, `--alarms`: what happens in the devices of all gateways, one line an
// event or change of an alarm.

std::string JsonLine(const dds::EventSample& event);
std::string PlainLine(const dds::EventSample& event);
std::string JsonLine(const dds::AlarmSample& alarm);
std::string PlainLine(const dds::AlarmSample& alarm);

/// As RunWatch.
int RunWatchEvents(const WatchOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
