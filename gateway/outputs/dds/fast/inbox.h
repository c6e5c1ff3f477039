// `Inbox` passes the samples of one topic from a Fast DDS reader to the subscriber's callbacks. The
// library's threads only wake the subscriber's thread, which takes the samples.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <functional>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/fast/subscriber.h"

namespace baudgate::dds {

inline constexpr std::int32_t kTakenAtOnce = 4000;

/// The id of an instance or writer in Fast DDS.
using Handle = std::array<std::uint8_t, 16>;

inline Handle HandleOf(const eprosima::fastdds::dds::InstanceHandle_t& from) {
  Handle handle;
  for (std::size_t i = 0; i < handle.size(); ++i) handle[i] = from.value[i];
  return handle;
}

/// Converts a handle to a WriterId; its first 12 bytes are the id of the participant.
inline WriterId WriterOf(const Handle& handle) {
  WriterId id;
  std::copy_n(handle.begin(), id.publisher.bytes.size(), id.publisher.bytes.begin());
  std::copy_n(handle.begin() + 12, id.entity.size(), id.entity.begin());
  return id;
}

struct HandleHash {
  std::size_t operator()(const Handle& handle) const {
    std::size_t hash = 0;  // copied from the handle, which is an MD5 already
    std::memcpy(&hash, handle.data(), sizeof hash);
    return hash;
  }
};

/// Stores the last sample of each instance, because Fast DDS 2.9 reports the end of an instance
/// without its key fields, and cannot look them up.
template <typename Sample>
class Inbox final : public eprosima::fastdds::dds::DataReaderListener {
 public:
  struct Callbacks {
    std::function<void(const Sample&, const Origin&)> on_sample;
    std::function<void(const Sample&, Gone)> on_gone;
    std::function<void(const PublisherId&)> on_publisher_left;
    std::function<void(int)> on_gateways;
    std::function<void(std::uint64_t)> on_rejected;
  };

  Inbox(std::function<void()> wake, Callbacks callbacks)
      : wake_(std::move(wake)), callbacks_(std::move(callbacks)) {}

  void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
    reader_ = reader;
    wake_();
  }
  void on_subscription_matched(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override {
    {
      const MutexLock lock(mutex_);
      matches_.push_back(
          {HandleOf(status.last_publication_handle), status.current_count_change < 0});
    }
    wake_();
  }
  void on_sample_rejected(eprosima::fastdds::dds::DataReader*,
                          const eprosima::fastdds::dds::SampleRejectedStatus& status) override {
    // Only the limit of instances loses a sample: after other rejections, the writer sends it
    // again.
    if (status.last_reason != eprosima::fastdds::dds::REJECTED_BY_INSTANCES_LIMIT) return;
    rejected_ += static_cast<std::uint64_t>(status.total_count_change);
    wake_();
  }

  /// Takes all samples from the reader and passes them to the callbacks. Returns the time that the
  /// library needed. Only one thread may call it.
  Duration TakeAll() {
    // `matches_` is read before the samples, because the last samples of a writer must be delivered
    // before the report that it has left.
    std::vector<Match> matches;
    {
      const MutexLock lock(mutex_);
      matches.swap(matches_);
    }
    Duration busy{};
    while (TakeLot(busy) == kTakenAtOnce) {
    }
    for (const Match& match : matches) Matched(match);
    const std::uint64_t rejected = rejected_;
    if (callbacks_.on_rejected && rejected != std::exchange(rejected_told_, rejected)) {
      callbacks_.on_rejected(rejected);
    }
    return busy;
  }

  /// takes() counts the calls of the library that returned samples; refused() counts samples that
  /// could not be decoded. Any thread may call them.
  std::uint64_t takes() const { return takes_; }
  std::uint64_t refused() const { return refused_; }

 private:
  struct Known {
    Sample sample;
    Handle writer{};
  };
  struct Match {
    Handle writer{};
    bool left = false;
  };

  std::int32_t TakeLot(Duration& busy) {
    auto* reader = reader_.load();
    if (reader == nullptr) return 0;
    // The library lends its own samples: with sequences of our own, Fast DDS 2.9 lost a third to
    // half of 5,000 samples a second.
    eprosima::fastdds::dds::LoanableSequence<Sample> samples;
    eprosima::fastdds::dds::SampleInfoSeq infos;
    const Instant begun = std::chrono::steady_clock::now();
    const bool some = reader->take(samples, infos, kTakenAtOnce) ==
                      eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
    busy += std::chrono::steady_clock::now() - begun;
    if (!some) return 0;
    ++takes_;
    const std::int32_t count = infos.length();
    for (std::int32_t i = 0; i < count; ++i) Take(samples[i], infos[i]);
    reader->return_loan(samples, infos);
    return count;
  }

  void Take(const Sample& sample, const eprosima::fastdds::dds::SampleInfo& info) {
    if (info.valid_data) {
      // An empty `gateway` marks a sample that could not be decoded
      // (gateway/outputs/dds/fast/types.cpp).
      if (sample.gateway.empty()) {
        ++refused_;
      } else {
        Arrived(sample, info);
      }
    } else if (info.instance_state != eprosima::fastdds::dds::ALIVE_INSTANCE_STATE) {
      const bool disposed =
          info.instance_state == eprosima::fastdds::dds::NOT_ALIVE_DISPOSED_INSTANCE_STATE;
      Left(HandleOf(info.instance_handle), disposed ? Gone::disposed : Gone::no_writers);
    }
  }

  void Arrived(const Sample& sample, const eprosima::fastdds::dds::SampleInfo& info) {
    Known& known = known_[HandleOf(info.instance_handle)];
    known.sample = sample;
    known.writer = HandleOf(info.publication_handle);
    const Duration received(info.reception_timestamp.to_ns());
    if (callbacks_.on_sample) {
      callbacks_.on_sample(known.sample, {WriterOf(known.writer), WallTime(received)});
    }
  }

  void Left(const Handle& instance, Gone why) {
    const auto at = known_.find(instance);
    if (at == known_.end()) return;
    if (callbacks_.on_gone) callbacks_.on_gone(at->second.sample, why);
    known_.erase(at);
  }

  void Matched(const Match& match) {
    const PublisherId publisher = WriterOf(match.writer).publisher;
    if (match.left) {
      WriterLeft(match.writer);
      if (--writers_[publisher] <= 0) {
        writers_.erase(publisher);
        if (callbacks_.on_publisher_left) callbacks_.on_publisher_left(publisher);
      }
    } else {
      ++writers_[publisher];
    }
    if (callbacks_.on_gateways) callbacks_.on_gateways(static_cast<int>(writers_.size()));
  }

  void WriterLeft(const Handle& writer) {
    for (auto at = known_.begin(); at != known_.end();) {
      if (at->second.writer == writer) {
        if (callbacks_.on_gone) callbacks_.on_gone(at->second.sample, Gone::no_writers);
        at = known_.erase(at);
      } else {
        ++at;
      }
    }
  }

  const std::function<void()> wake_;
  const Callbacks callbacks_;
  Mutex mutex_;
  std::vector<Match> matches_ BAUDGATE_GUARDED_BY(mutex_);
  /// Null until the first samples have arrived.
  std::atomic<eprosima::fastdds::dds::DataReader*> reader_ = nullptr;
  std::atomic<std::uint64_t> rejected_ = 0;
  std::atomic<std::uint64_t> takes_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;

  // Only the thread that calls TakeAll uses the following members.
  std::uint64_t rejected_told_ = 0;
  std::unordered_map<Handle, Known, HandleHash> known_;
  /// Number of writers of each participant. A gateway with many points has several writers of one
  /// topic.
  std::map<PublisherId, int> writers_;
};

}  // namespace baudgate::dds
