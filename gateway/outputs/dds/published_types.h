// `Contract` lists the fields of each published type of gateway/outputs/dds/baudgate.idl; a test
// compares it with the IDL. From these lists the code derives the wire form (Encode, Decode), the
// key hashes, the types for generic tools (gateway/outputs/dds/fast/types.h), baudgate_types.xml
// (TypesXml), and the JSON of `watch` (gateway/tools/watch/watch_lines.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "gateway/base/bytes.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

template <typename Sample, typename Value>
struct Field {
  std::string_view name;
  Value Sample::*member;
  std::uint32_t bound = 0;  ///< longest text in bytes; 0: the field is not a text
  bool key = false;
};

namespace contract {

template <typename Sample>
constexpr Field<Sample, std::string> Key(std::string_view name, std::string Sample::*member,
                                         std::uint32_t bound = kMaxKey) {
  return {name, member, bound, true};
}
template <typename Sample>
constexpr Field<Sample, std::string> Text(std::string_view name, std::string Sample::*member,
                                          std::uint32_t bound) {
  return {name, member, bound};
}
template <typename Sample, typename Value>
constexpr Field<Sample, Value> Plain(std::string_view name, Value Sample::*member) {
  return {name, member};
}

/// Contains the type's name in module baudgate::v1, and its fields in the order of the IDL.
template <typename Sample>
struct Contract;

template <>
struct Contract<PointSample> {
  using S = PointSample;
  static constexpr std::string_view kName = "PointSample";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("device", &S::device),
                                         Key("point", &S::point),
                                         Plain("value", &S::value),
                                         Text("text", &S::text, kMaxText),
                                         Text("unit", &S::unit, kMaxUnit),
                                         Plain("quality", &S::quality),
                                         Plain("source_time_ns", &S::source_time_ns),
                                         Plain("seq", &S::seq),
                                         Plain("rtt_us", &S::rtt_us)};
};

template <>
struct Contract<DeviceSample> {
  using S = DeviceSample;
  static constexpr std::string_view kName = "DeviceStatus";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("device", &S::device),
                                         Text("line", &S::line, kMaxKey),
                                         Plain("state", &S::state),
                                         Plain("last_outcome", &S::last_outcome),
                                         Plain("last_ok_time_ns", &S::last_ok_time_ns),
                                         Plain("exchanges", &S::exchanges),
                                         Plain("ok", &S::ok),
                                         Plain("no_reply", &S::no_reply),
                                         Plain("corrupt", &S::corrupt),
                                         Plain("retries", &S::retries),
                                         Plain("rtt_mean_us", &S::rtt_mean_us),
                                         Plain("rtt_p99_us", &S::rtt_p99_us)};
};

template <>
struct Contract<GatewaySample> {
  using S = GatewaySample;
  static constexpr std::string_view kName = "GatewayStatus";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Plain("start_time_ns", &S::start_time_ns),
                                         Text("version", &S::version, kMaxVersion)};
};

template <>
struct Contract<EventSample> {
  using S = EventSample;
  static constexpr std::string_view kName = "DeviceEvent";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("device", &S::device),
                                         Plain("seq", &S::seq),
                                         Plain("device_time_ns", &S::device_time_ns),
                                         Plain("receive_time_ns", &S::receive_time_ns),
                                         Plain("clock_quality", &S::clock_quality),
                                         Plain("channel", &S::channel),
                                         Plain("code", &S::code),
                                         Text("text", &S::text, kMaxText)};
};

template <>
struct Contract<AlarmSample> {
  using S = AlarmSample;
  static constexpr std::string_view kName = "AlarmState";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("line", &S::line),
                                         Key("device", &S::device),
                                         Key("name", &S::name, kMaxAlarmName),
                                         Text("point", &S::point, kMaxKey),
                                         Plain("state", &S::state),
                                         Plain("priority", &S::priority),
                                         Plain("seq", &S::seq),
                                         Plain("raised_time_ns", &S::raised_time_ns),
                                         Plain("changed_time_ns", &S::changed_time_ns),
                                         Text("text", &S::text, kMaxText),
                                         Text("acknowledged_by", &S::acknowledged_by, kMaxKey)};
};

template <>
struct Contract<RequestSample> {
  using S = RequestSample;
  static constexpr std::string_view kName = "WriteRequest";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("client", &S::client),
                                         Plain("seq", &S::seq),
                                         Text("device", &S::device, kMaxKey),
                                         Text("point", &S::point, kMaxKey),
                                         Plain("value", &S::value),
                                         Text("text", &S::text, kMaxText),
                                         Plain("confirm", &S::confirm),
                                         Plain("deadline_ms", &S::deadline_ms),
                                         Plain("not_after_ns", &S::not_after_ns)};
};

template <>
struct Contract<ReplySample> {
  using S = ReplySample;
  static constexpr std::string_view kName = "WriteReply";
  static constexpr std::tuple kFields = {Key("gateway", &S::gateway),
                                         Key("client", &S::client),
                                         Plain("seq", &S::seq),
                                         Text("outcome", &S::outcome, kMaxOutcome),
                                         Text("reason", &S::reason, kMaxReason),
                                         Plain("took_us", &S::took_us)};
};

}  // namespace contract

/// Calls `use` with each field, in the order of the wire form.
template <typename Sample, typename Use>
constexpr void ForEachField(Use use) {
  std::apply([&use](const auto&... field) { (use(field), ...); },
             contract::Contract<Sample>::kFields);
}

struct TypeField {
  enum class Kind : std::uint8_t { text, boolean, float64, uint16, uint32, int64, uint64 };
  std::string_view name;
  Kind kind = Kind::text;
  std::uint32_t bound = 0;
  bool key = false;
};

struct TypeDescription {
  std::string_view name;
  std::span<const TypeField> fields;
};

template <typename Value>
constexpr TypeField::Kind KindOf() {
  using Kind = TypeField::Kind;
  if constexpr (std::is_same_v<Value, std::string>) return Kind::text;
  if constexpr (std::is_same_v<Value, bool>) return Kind::boolean;
  if constexpr (std::is_same_v<Value, double>) return Kind::float64;
  if constexpr (std::is_same_v<Value, std::uint16_t>) return Kind::uint16;
  if constexpr (std::is_same_v<Value, std::uint32_t>) return Kind::uint32;
  if constexpr (std::is_same_v<Value, std::int64_t>) return Kind::int64;
  if constexpr (std::is_same_v<Value, std::uint64_t>) return Kind::uint64;
}

template <typename Sample, typename Value>
constexpr TypeField Described(const Field<Sample, Value>& field) {
  return {field.name, KindOf<Value>(), field.bound, field.key};
}

template <typename Sample>
inline constexpr auto kTypeFields =
    std::apply([](const auto&... field) { return std::array{Described(field)...}; },
               contract::Contract<Sample>::kFields);

template <typename Sample>
inline constexpr TypeDescription kTypeOf = {contract::Contract<Sample>::kName, kTypeFields<Sample>};

template <typename Use>
void ForEachType(Use use) {
  use(kTypeOf<PointSample>);
  use(kTypeOf<EventSample>);
  use(kTypeOf<DeviceSample>);
  use(kTypeOf<GatewaySample>);
  use(kTypeOf<AlarmSample>);
  use(kTypeOf<RequestSample>);
  use(kTypeOf<ReplySample>);
}

// Encode and Decode convert samples to and from the wire form: XCDR1, as code from any vendor's IDL
// compiler writes it.

/// The size of the encapsulation header: a representation identifier (CDR_BE 00 00, CDR_LE 00 01)
/// and two bytes of options.
inline constexpr std::size_t kCdrHead = 4;

/// Returns the first position from `at` at which a number of `size` bytes can begin: a multiple of
/// `size`, counted from the end of the encapsulation header.
constexpr std::size_t Aligned(std::size_t at, std::size_t size) {
  return kCdrHead + (at - kCdrHead + size - 1) / size * size;
}

template <typename Sample>
constexpr std::size_t LongestSample() {
  std::size_t at = kCdrHead;
  ForEachField<Sample>([&at]<typename Value>(const Field<Sample, Value>& field) {
    if constexpr (std::is_same_v<Value, std::string>) {
      at = Aligned(at, sizeof(std::uint32_t)) + sizeof(std::uint32_t) + field.bound + 1;
    } else {
      at = Aligned(at, sizeof(Value)) + sizeof(Value);
    }
  });
  return at;
}
template <typename Sample>
inline constexpr std::size_t kMaxBytes = LongestSample<Sample>();

/// Writes little-endian CDR with its encapsulation header. Returns the number of bytes; 0 if a text
/// is longer than its bound or `to` is too small. Instantiated for all samples of
/// gateway/outputs/dds/samples.h.
template <typename Sample>
std::size_t Encode(const Sample& sample, std::span<std::uint8_t> to);

/// Reads a sample in either byte order. False unless the bytes are exactly one sample within its
/// bounds; `sample` is then unspecified. Never throws.
template <typename Sample>
bool Decode(View bytes, Sample& sample);

// TypesXml returns the published types as DDS-XML, for tools that load types from a file (RTI Admin
// Console, PlotJuggler). `baudgate-dds --types-xml` prints it.

std::string TypesXml();

}  // namespace baudgate::dds
