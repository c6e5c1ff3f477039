// Which writers keep nothing for readers to come. Only their requests are carried out: a writer
// that keeps what it wrote must not send it to a volatile reader that is new, but Cyclone DDS 0.10
// does, because Fast DDS 2.9 asks for all that a heartbeat names.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <string>
#include <unordered_set>

#include "gateway/base/guarded.h"
#include "gateway/outputs/dds/fast/inbox.h"

namespace baudgate::dds {

class VolatileWriters {
 public:
  /// Those of this topic.
  explicit VolatileWriters(std::string topic) : topic_(std::move(topic)) {}

  /// False, too, where nothing is known of it. From any thread.
  bool Has(const Handle& writer) const;
  /// A writer was found, has changed or has left. From any thread.
  void OnWriter(const eprosima::fastrtps::rtps::WriterDiscoveryInfo& info);

 private:
  static constexpr std::size_t kMost = 8192;

  const std::string topic_;
  mutable Mutex mutex_;
  std::unordered_set<Handle, HandleHash> writers_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::dds
