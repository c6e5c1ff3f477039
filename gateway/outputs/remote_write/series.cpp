// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/remote_write/series.h"

#include <snappy-c.h>

#include <bit>
#include <set>
#include <string_view>
#include <utility>

namespace baudgate::remote_write {
namespace {

// The kinds of fields of Protocol Buffers that a request needs.
enum Wire : std::uint8_t { kNumber = 0, kEightBytes = 1, kBytes = 2 };

void AppendNumber(std::string& out, std::uint64_t number) {
  for (; number >= 0x80; number >>= 7U) out += static_cast<char>(number | 0x80U);
  out += static_cast<char>(number);
}

void AppendKey(std::string& out, unsigned field, Wire wire) {
  AppendNumber(out, field << 3U | wire);
}

void AppendBytes(std::string& out, unsigned field, std::string_view bytes) {
  AppendKey(out, field, kBytes);
  AppendNumber(out, bytes.size());
  out += bytes;
}

void AppendSample(std::string& out, std::uint64_t bits, std::int64_t time) {
  std::string sample;
  AppendKey(sample, 1, kEightBytes);
  for (unsigned shift = 0; shift < 64; shift += 8) sample += static_cast<char>(bits >> shift);
  AppendKey(sample, 2, kNumber);
  AppendNumber(sample, static_cast<std::uint64_t>(time));
  AppendBytes(out, 2, sample);
}

std::uint64_t BitsOf(const history::Entry& entry) {
  if (!IsGood(entry.quality) || !HasValue(entry.value)) return kStale;
  return std::bit_cast<std::uint64_t>(ToDouble(entry.value));
}

}  // namespace

SeriesNames::SeriesNames(const config::Config& config)
    : gateway_(config.name), labels_(config.remote_write.labels) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      for (const config::Point& point : device.points) {
        const std::string name = line.name + "." + device.name + "." + point.name;
        if (point.type == config::Type::string) texts_[name] = true;
        if (!point.unit.empty()) units_[name] = point.unit;
      }
    }
  }
}

std::string SeriesNames::LabelsOf(const std::string& point) const {
  const std::size_t first = point.find('.');
  const std::size_t last = point.rfind('.');
  const auto unit = units_.find(point);
  std::map<std::string_view, std::string_view> all;
  for (const config::RemoteWrite::Label& label : labels_) all[label.name] = label.value;
  const std::string_view text = point;
  all["__name__"] = "baudgate_point_value";
  all["gateway"] = gateway_;
  all["line"] = text.substr(0, first);
  all["device"] = text.substr(first + 1, last - first - 1);
  all["point"] = text.substr(last + 1);
  // A label without a text is the same as no label, and a request must not have it.
  if (unit != units_.end()) all["unit"] = unit->second;
  std::string out;
  for (const auto& [name, value] : all) {
    std::string label;
    AppendBytes(label, 1, name);
    AppendBytes(label, 2, value);
    AppendBytes(out, 1, label);
  }
  return out;
}

WriteRequest Encode(const SeriesNames& names, std::span<const outlet::KeptValue> values) {
  WriteRequest request;
  std::string message;
  for (std::size_t i = 0; i < values.size();) {
    const std::string& point = values[i].point;
    const bool has_series = names.Has(point);
    std::string series = has_series ? names.LabelsOf(point) : std::string();
    const std::size_t before = request.samples;
    for (; i < values.size() && values[i].point == point; ++i) {
      const history::Entry& entry = values[i].entry;
      if (!has_series || std::holds_alternative<std::string>(entry.value)) continue;
      AppendSample(series, BitsOf(entry), entry.time);
      ++request.samples;
    }
    if (request.samples > before) AppendBytes(message, 1, series);
  }
  if (message.empty()) return request;
  std::size_t size = snappy_max_compressed_length(message.size());
  request.body.resize(size);
  snappy_compress(message.data(), message.size(), request.body.data(), &size);
  request.body.resize(size);
  return request;
}

}  // namespace baudgate::remote_write
