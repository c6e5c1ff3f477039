// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/discovery_listener.h"

#include <fastdds/rtps/builtin/data/ReaderProxyData.h>
#include <fastdds/rtps/builtin/data/WriterProxyData.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "gateway/base/text.h"
#include "gateway/outputs/dds/samples.h"

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

namespace {

namespace fast = eprosima::fastdds::dds;
namespace wire = eprosima::fastrtps::rtps;
using eprosima::fastrtps::c_TimeInfinite;
using Reader = wire::ReaderProxyData;

struct Policy {
  std::string_view asks_for;
  bool (*is_asked)(const fast::ReaderQos& qos);
};

/// The QoS that the gateway's writers do not offer. DDS does not match a reader that requests one
/// of them (DDS 1.4, 2.2.3).
constexpr Policy kPolicies[] = {
    {"DEADLINE",
     [](const fast::ReaderQos& qos) { return qos.m_deadline.period != c_TimeInfinite; }},
    {"exclusive OWNERSHIP",
     [](const fast::ReaderQos& qos) {
       return qos.m_ownership.kind == fast::EXCLUSIVE_OWNERSHIP_QOS;
     }},
    {"LIVELINESS with a lease or a manual kind",
     [](const fast::ReaderQos& qos) {
       return qos.m_liveliness.lease_duration != c_TimeInfinite ||
              qos.m_liveliness.kind != fast::AUTOMATIC_LIVELINESS_QOS;
     }},
    {"a PARTITION",
     [](const fast::ReaderQos& qos) {
       const auto names = qos.m_partition.names();
       return !names.empty() && std::ranges::none_of(names, &std::string::empty);
     }},
    {"DURABILITY beyond TRANSIENT_LOCAL",
     [](const fast::ReaderQos& qos) {
       return qos.m_durability.kind > fast::TRANSIENT_LOCAL_DURABILITY_QOS;
     }},
    {"DESTINATION_ORDER by source timestamp",
     [](const fast::ReaderQos& qos) {
       return qos.m_destinationOrder.kind == fast::BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS;
     }},
    {"PRESENTATION beyond INSTANCE",
     [](const fast::ReaderQos& qos) {
       return qos.m_presentation.access_scope != fast::INSTANCE_PRESENTATION_QOS ||
              qos.m_presentation.coherent_access || qos.m_presentation.ordered_access;
     }},
    {"XCDR2 alone", [](const fast::ReaderQos& qos) {
       const auto& ids = qos.representation.m_value;
       return !ids.empty() && std::ranges::find(ids, fast::XCDR_DATA_REPRESENTATION) == ids.end();
     }}};

constexpr std::string_view kTopics[] = {kPointTopic, kDeviceTopic, kGatewayTopic,
                                        kEventTopic, kAlarmTopic,  kReplyTopic};

std::string HostOf(const Reader& reader) {
  const auto& at = reader.remote_locators().unicast;
  return at.empty() ? "an unknown address" : wire::IPLocator::ip_to_string(at[0]);
}

std::string Unmet(const Reader& reader) {
  std::string asked;
  for (const Policy& policy : kPolicies) {
    if (!policy.is_asked(reader.m_qos)) continue;
    if (!asked.empty()) asked += " and ";
    asked += policy.asks_for;
  }
  if (asked.empty()) return {};
  return "a reader of " + reader.topicName().to_string() + " at " + HostOf(reader) +
         " receives no samples, because it asks for " + asked +
         ", which is not offered; docs/dds.md lists what a reader may request";
}

}  // namespace

void UnmetReaders::OnReader(const wire::ReaderDiscoveryInfo& info) {
  if (std::ranges::find(kTopics, std::string_view(info.info.topicName().c_str())) ==
      std::end(kTopics)) {
    return;
  }
  const Handle reader = HandleOf(fast::InstanceHandle_t(info.info.guid()));
  const bool there = info.status != wire::ReaderDiscoveryInfo::REMOVED_READER;
  std::string unmet = there ? Unmet(info.info) : std::string();
  const MutexLock lock(mutex_);
  readers_.erase(reader);
  if (!unmet.empty() && readers_.size() < kMost) readers_.emplace(reader, std::move(unmet));
}

std::vector<std::string> UnmetReaders::Sentences() const {
  std::set<std::string> sentences;
  {
    const MutexLock lock(mutex_);
    for (const auto& [reader, sentence] : readers_) sentences.insert(sentence);
  }
  return {sentences.begin(), sentences.end()};
}

}  // namespace baudgate::dds
