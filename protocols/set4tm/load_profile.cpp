// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/load_profile.h"

#include <numeric>

#include "protocols/set4tm/civil_bcd.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::size_t kSum = 6;
constexpr std::uint16_t kIncomplete = 0x8000;
constexpr std::array<const char*, 4> kProfileNames = {"active_import", "active_export",
                                                      "reactive_import", "reactive_export"};

std::uint8_t SumOf(View header) {
  const View summed = header.first(kSum);
  return static_cast<std::uint8_t>(std::accumulate(summed.begin(), summed.end(), 0U));
}

/// Hour, day, month and year; minute 0.
std::optional<CivilZone::Civil> HourOf(View bytes) {
  return CivilOf(Bytes{0, 0, bytes[0], 0, bytes[1], bytes[2], bytes[3]});
}

bool FillsAnHour(unsigned minutes) { return minutes != 0 && minutes <= 60 && 60 % minutes == 0; }

}  // namespace

std::optional<LoadHeader> ParseLoadHeader(View record) {
  if (record.size() != kLoadRecord || record[kSum] != SumOf(record)) return std::nullopt;
  const auto begin = HourOf(record);
  if (!begin || record[4] > 1 || !FillsAnHour(record[5])) return std::nullopt;
  return LoadHeader{*begin, record[4] == 0, record[5]};
}

Bytes BytesOf(const LoadHeader& header) {
  const Bytes civil = BytesOf(header.begin);
  Bytes record = {civil[2],
                  civil[4],
                  civil[5],
                  civil[6],
                  static_cast<std::uint8_t>(!header.summer),
                  static_cast<std::uint8_t>(header.minutes)};
  record.push_back(SumOf(record));
  record.push_back(0);
  return record;
}

CivilZone::Utc UtcOf(const LoadHeader& header, const CivilZone& zone) {
  const CivilZone::Moment moment = zone.ToUtc(header.begin);
  const bool first = moment.fit == CivilZone::Fit::twice && header.summer;
  return moment.utc - std::chrono::hours(first ? 1 : 0);
}

LoadSlice ParseLoadSlice(View record) {
  LoadSlice slice;
  for (std::size_t i = 0; i < slice.counts.size(); ++i) {
    const std::uint16_t word = ByteReader(record).U16Be(2 * i).value_or(kIncomplete);
    slice.counts[i] = {static_cast<std::uint16_t>(word & ~unsigned{kIncomplete}),
                       (word & kIncomplete) != 0};
  }
  return slice;
}

std::optional<LoadPointer> ParseLoadPointer(View data) {
  if (data.size() != 7) return std::nullopt;
  const auto minute = static_cast<std::uint8_t>(data[0] & 0x7FU);
  const auto at = CivilOf(Bytes{0, minute, data[1], 0, data[2], data[3], data[4]});
  if (!at) return std::nullopt;
  const auto hour = std::chrono::floor<std::chrono::hours>(*at);
  return LoadPointer{hour, static_cast<unsigned>((*at - hour) / std::chrono::minutes(1)),
                     (data[0] & 0x80U) != 0, *ByteReader(data).U16Be(5)};
}

std::optional<LoadRing::Hour> LoadRing::HourOf(const LoadPointer& pointer) const {
  const std::size_t behind = kLoadRecord * (1 + pointer.minute / minutes);
  if (pointer.address % kLoadRecord != 0 || pointer.address < behind ||
      pointer.address - behind + block() > bytes)
    return std::nullopt;
  return Hour{pointer.address - behind, pointer.minute / minutes};
}

std::optional<LoadRing::Hour> LoadRing::HourBehind(const LoadPointer& pointer) const {
  if (pointer.address % kLoadRecord != 0 || pointer.address > bytes) return std::nullopt;
  return Hour{pointer.address + block() > bytes ? 0 : pointer.address, 0};
}

std::string NameOfLoad(unsigned profile) { return "load_" + std::to_string(profile); }

PastRecord RecordOf(unsigned profile, const LoadHeader& header, std::size_t slice,
                    const LoadSlice& counts, const CivilZone& zone, const Scale& scale) {
  const std::chrono::minutes span(header.minutes);
  PastRecord record;
  record.series = NameOfLoad(profile);
  record.begin = UtcOf(header, zone).time_since_epoch() + static_cast<std::int64_t>(slice) * span;
  record.span = span;
  const auto factor = FactorOf(Measure::energy, scale);
  for (std::size_t i = 0; i < kProfileNames.size(); ++i) {
    PastValue value{kProfileNames[i], {}, Quality::bad_configuration, i < 2 ? "kW" : "kvar"};
    if (factor) {
      value.value = counts.counts[i].pulses * factor->multiply * 60 /
                    (factor->divide * static_cast<double>(header.minutes));
      value.quality = counts.counts[i].incomplete ? Quality::uncertain_sub_normal : Quality::good;
    }
    record.values.push_back(std::move(value));
  }
  return record;
}

}  // namespace baudgate::protocols::set4tm
