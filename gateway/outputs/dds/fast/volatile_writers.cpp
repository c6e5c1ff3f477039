// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/volatile_writers.h"

#include <fastdds/rtps/builtin/data/WriterProxyData.h>

namespace baudgate::dds {

bool VolatileWriters::Has(const Handle& writer) const {
  const MutexLock lock(mutex_);
  return writers_.contains(writer);
}

void VolatileWriters::OnWriter(const eprosima::fastrtps::rtps::WriterDiscoveryInfo& info) {
  using Info = eprosima::fastrtps::rtps::WriterDiscoveryInfo;
  if (info.info.topicName() != topic_) return;
  const Handle writer = HandleOf(eprosima::fastdds::dds::InstanceHandle_t(info.info.guid()));
  const bool there = info.status != Info::REMOVED_WRITER;
  const bool keeps_nothing =
      info.info.m_qos.m_durability.kind == eprosima::fastdds::dds::VOLATILE_DURABILITY_QOS;
  const MutexLock lock(mutex_);
  if (!there || !keeps_nothing) {
    writers_.erase(writer);
  } else if (writers_.size() < kMost) {
    writers_.insert(writer);
  }
}

}  // namespace baudgate::dds
