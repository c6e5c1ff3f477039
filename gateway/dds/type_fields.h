// The fields of the published types, as baudgate.idl says them: for announcing the types to generic
// tools (gateway/dds/fast/type_objects.h). tests/gateway/dds/type_fields_test.cpp compares this
// table with the IDL and with baudgate_types.xml.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "gateway/dds/samples.h"

namespace baudgate::dds {

struct TypeField {
  enum class Kind : std::uint8_t { text, boolean, float64, uint16, uint32, int64, uint64 };
  std::string_view name;
  Kind kind = Kind::text;
  std::uint32_t bound = 0;  ///< of a text, in bytes
  bool key = false;

  static constexpr TypeField Key(std::string_view name, std::uint32_t bound = kMaxKey) {
    return {name, Kind::text, bound, true};
  }
  static constexpr TypeField Text(std::string_view name, std::uint32_t bound) {
    return {name, Kind::text, bound, false};
  }
};

struct TypeDescription {
  std::string_view name;  ///< in module baudgate::v1
  std::span<const TypeField> fields;
};

namespace type_fields {

using Kind = TypeField::Kind;

inline constexpr std::array kPoint = {
    TypeField::Key("gateway"),
    TypeField::Key("device"),
    TypeField::Key("point"),
    TypeField{"value", Kind::float64},
    TypeField::Text("text", kMaxText),
    TypeField::Text("unit", kMaxUnit),
    TypeField{"quality", Kind::uint16},
    TypeField{"source_time_ns", Kind::int64},
    TypeField{"seq", Kind::uint64},
    TypeField{"rtt_us", Kind::uint32},
};

inline constexpr std::array kDevice = {
    TypeField::Key("gateway"),
    TypeField::Key("device"),
    TypeField::Text("line", kMaxKey),
    TypeField{"state", Kind::uint16},
    TypeField{"last_outcome", Kind::uint16},
    TypeField{"last_ok_time_ns", Kind::int64},
    TypeField{"exchanges", Kind::uint32},
    TypeField{"ok", Kind::uint32},
    TypeField{"no_reply", Kind::uint32},
    TypeField{"corrupt", Kind::uint32},
    TypeField{"retries", Kind::uint32},
    TypeField{"rtt_mean_us", Kind::uint32},
    TypeField{"rtt_p99_us", Kind::uint32},
};

inline constexpr std::array kGateway = {
    TypeField::Key("gateway"),
    TypeField{"start_time_ns", Kind::int64},
    TypeField::Text("version", kMaxVersion),
};

inline constexpr std::array kEvent = {
    TypeField::Key("gateway"),
    TypeField::Key("device"),
    TypeField{"seq", Kind::uint64},
    TypeField{"device_time_ns", Kind::int64},
    TypeField{"receive_time_ns", Kind::int64},
    TypeField{"clock_quality", Kind::uint16},
    TypeField{"channel", Kind::uint16},
    TypeField{"code", Kind::uint32},
    TypeField::Text("text", kMaxText),
};

inline constexpr std::array kAlarm = {
    TypeField::Key("gateway"),
    TypeField::Key("line"),
    TypeField::Key("device"),
    TypeField::Key("name", kMaxAlarmName),
    TypeField::Text("point", kMaxKey),
    TypeField{"state", Kind::uint16},
    TypeField{"priority", Kind::uint16},
    TypeField{"seq", Kind::uint64},
    TypeField{"raised_time_ns", Kind::int64},
    TypeField{"changed_time_ns", Kind::int64},
    TypeField::Text("text", kMaxText),
    TypeField::Text("acknowledged_by", kMaxKey),
};

inline constexpr std::array kRequest = {
    TypeField::Key("gateway"),
    TypeField::Key("client"),
    TypeField{"seq", Kind::uint64},
    TypeField::Text("device", kMaxKey),
    TypeField::Text("point", kMaxKey),
    TypeField{"value", Kind::float64},
    TypeField::Text("text", kMaxText),
    TypeField{"confirm", Kind::boolean},
    TypeField{"deadline_ms", Kind::uint32},
    TypeField{"not_after_ns", Kind::int64},
};

inline constexpr std::array kReply = {
    TypeField::Key("gateway"),
    TypeField::Key("client"),
    TypeField{"seq", Kind::uint64},
    TypeField::Text("outcome", kMaxOutcome),
    TypeField::Text("reason", kMaxReason),
    TypeField{"took_us", Kind::uint32},
};

}  // namespace type_fields

inline constexpr TypeDescription kPointType = {"PointSample", type_fields::kPoint};
inline constexpr TypeDescription kDeviceType = {"DeviceStatus", type_fields::kDevice};
inline constexpr TypeDescription kGatewayType = {"GatewayStatus", type_fields::kGateway};
inline constexpr TypeDescription kEventType = {"DeviceEvent", type_fields::kEvent};
inline constexpr TypeDescription kAlarmType = {"AlarmState", type_fields::kAlarm};
inline constexpr TypeDescription kRequestType = {"WriteRequest", type_fields::kRequest};
inline constexpr TypeDescription kReplyType = {"WriteReply", type_fields::kReply};

}  // namespace baudgate::dds
