// `PointSample` and the structs below are the samples of gateway/outputs/dds/baudgate.idl, with the
// bounds of their texts. gateway/outputs/dds/point_samples.cpp fills them from the point store,
// gateway/outputs/dds/published_types.cpp from received bytes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace baudgate::dds {

inline constexpr char kPointTopic[] = "baudgate/points";
inline constexpr char kDeviceTopic[] = "baudgate/devices";
inline constexpr char kGatewayTopic[] = "baudgate/gateways";
inline constexpr char kEventTopic[] = "baudgate/events";
inline constexpr char kAlarmTopic[] = "baudgate/alarms";
inline constexpr char kRequestTopic[] = "baudgate/write";
inline constexpr char kReplyTopic[] = "baudgate/write_reply";

/// The number of a device's newest events that a late subscriber gets.
inline constexpr std::size_t kEventDepth = 1000;

/// Longest texts in gateway/outputs/dds/baudgate.idl, in bytes.
inline constexpr std::size_t kMaxKey = 64;
inline constexpr std::size_t kMaxText = 128;
inline constexpr std::size_t kMaxUnit = 16;
inline constexpr std::size_t kMaxVersion = 32;
inline constexpr std::size_t kMaxAlarmName = 128;
inline constexpr std::size_t kMaxOutcome = 16;
inline constexpr std::size_t kMaxReason = 256;

struct PointSample {
  std::string gateway;  ///< key
  std::string device;   ///< key
  std::string point;    ///< key
  double value = 0;     ///< NaN for a text, and before the first reading
  /// A text value, or the digits of a whole number that a double would round; else empty.
  std::string text;
  std::string unit;
  std::uint16_t quality = 0;  ///< see Quality::word() in gateway/base/value.h
  /// Time of the value in ns since 1970 UTC; 0 before the first reading.
  std::int64_t source_time_ns = 0;
  std::uint64_t seq = 0;  ///< number of the reading of this point since the gateway's start
  std::uint32_t rtt_us = 0;

  bool operator==(const PointSample&) const = default;
};

struct DeviceSample {
  std::string gateway;  ///< key
  std::string device;   ///< key
  std::string line;
  std::uint16_t state = 0;         ///< a DeviceState of gateway/bus/points/device_status.h
  std::uint16_t last_outcome = 0;  ///< an Outcome of gateway/base/outcome.h
  std::int64_t last_ok_time_ns = 0;
  std::uint32_t exchanges = 0;
  std::uint32_t ok = 0;
  std::uint32_t no_reply = 0;
  std::uint32_t corrupt = 0;
  std::uint32_t retries = 0;
  std::uint32_t rtt_mean_us = 0;
  std::uint32_t rtt_p99_us = 0;

  bool operator==(const DeviceSample&) const = default;
};

/// A gateway publishes this sample at its start and again for each new baudgate-dds process.
struct GatewaySample {
  std::string gateway;  ///< key
  /// The start of the gateway (not of baudgate-dds), in ns since 1970 UTC. PointSample::seq counts
  /// from this start.
  std::int64_t start_time_ns = 0;
  std::string version;

  bool operator==(const GatewaySample&) const = default;
};

/// An event that a device has recorded or the gateway has detected (docs/events.md). It is
/// published only after it is stored on the disk.
struct EventSample {
  std::string gateway;  ///< key
  std::string device;   ///< key
  /// Number of the event; counts all events of the gateway, across restarts.
  std::uint64_t seq = 0;
  std::int64_t device_time_ns = 0;  ///< nanoseconds since 1970 UTC
  std::int64_t receive_time_ns = 0;
  std::uint16_t clock_quality = 0;  ///< a ClockQuality of gateway/records/events/event_record.h
  std::uint16_t channel = 0;
  std::uint32_t code = 0;
  std::string text;

  bool operator==(const EventSample&) const = default;
};

/// The present state of an alarm (docs/events.md). If events are stored on the disk, it is
/// published only after it is stored.
struct AlarmSample {
  std::string gateway;  ///< key
  std::string line;     ///< key
  std::string device;   ///< key
  std::string name;     ///< key
  std::string point;    ///< empty: the alarm concerns the device itself
  /// An AlarmState of gateway/records/events/alarm.h; 0: the alarm is over and acknowledged.
  std::uint16_t state = 0;
  std::uint16_t priority = 0;  ///< 1 low, 2 medium, 3 high
  std::uint64_t seq = 0;       ///< number of the event that raised the alarm
  std::int64_t raised_time_ns = 0;
  std::int64_t changed_time_ns = 0;  ///< time of the last change of `state`
  std::string text;
  std::string acknowledged_by;  ///< user who acknowledged the alarm; empty: not acknowledged

  bool operator==(const AlarmSample&) const = default;
};

/// A client's request to write one point (docs/dds.md, "Writing").
struct RequestSample {
  std::string gateway;  ///< key
  std::string client;   ///< key; the name that the client has chosen for itself
  /// Number of the client's request; a repeated number is carried out only once.
  std::uint64_t seq = 0;
  std::string device;
  std::string point;
  double value = 0;      ///< value in the unit that users see; used if `text` is empty
  std::string text;      ///< value as it is typed for `baudgate write`; replaces `value`
  bool confirm = false;  ///< true: the point need not be selected before
  /// The longest time from the arrival of the request to the write, at most 60 s; 0: the gateway's
  /// default.
  std::uint32_t deadline_ms = 0;
  /// The latest time of the write in ns since 1970 UTC, by the gateway's clock; 0: no limit.
  std::int64_t not_after_ns = 0;

  bool operator==(const RequestSample&) const = default;
};

struct ReplySample {
  std::string gateway;  ///< key
  std::string client;   ///< key
  std::uint64_t seq = 0;
  std::string outcome;  ///< name of a WriteEnd (gateway/base/outcome.h)
  std::string reason;   ///< one sentence; empty if the outcome is ok
  std::uint32_t took_us = 0;

  bool operator==(const ReplySample&) const = default;
};

/// Copies `text` into `to` as UTF-8 of at most `bound` bytes. Each byte that is not UTF-8 is
/// replaced by U+FFFD, and a text that is too long is cut and ends in "…", so that a reader sees
/// that something is wrong or missing. The text ends at the first NUL.
void AssignBounded(std::string& to, std::string_view text, std::size_t bound);

}  // namespace baudgate::dds
