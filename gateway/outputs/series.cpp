// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/series.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iterator>

namespace baudgate::outputs {
namespace {

constexpr std::size_t kDeviceStates = 5;
/// RoundTrips has four buckets per octave (a doubling of the time).
constexpr std::size_t kOctaves = bus::RoundTrips::kBuckets / 4;

constexpr std::array<std::string_view, bus::kLineUses> kWhy = {"poll",  "probe",   "route",
                                                               "write", "silence", "drain"};

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

std::string EscapedLabel(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    out += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return out;
}

void Series::Add(std::string_view labels, double value, std::string_view suffix) {
  auto to = std::back_inserter(text_);
  fmt::format_to(to, "{}{}", metric_.name, suffix);
  if (!labels.empty()) fmt::format_to(to, "{{{}}}", labels);
  if (std::isnan(value)) {
    text_ += " NaN\n";
  } else if (std::isinf(value)) {
    text_ += value > 0 ? " +Inf\n" : " -Inf\n";
  } else {
    fmt::format_to(to, " {}\n", value);
  }
}

void Series::AppendTo(std::string& out) const {
  if (text_.empty()) return;
  fmt::format_to(std::back_inserter(out), "# HELP {0} {1}\n# TYPE {0} {2}\n", metric_.name,
                 metric_.help, metric_.type);
  out += text_;
}

void EachValue(bus::DeviceState state, const AddValue& add) {
  for (std::size_t i = 0; i < kDeviceStates; ++i) {
    const auto one = static_cast<bus::DeviceState>(i);
    add(fmt::format("state=\"{}\"", Name(one)), state == one ? 1 : 0, "");
  }
}

void EachValue(const bus::TimeByUse& times, const AddValue& add) {
  for (std::size_t i = 0; i < bus::kLineUses; ++i) {
    add(fmt::format("why=\"{}\"", kWhy[i]), Seconds(times[i]), "");
  }
}

void EachValue(const bus::RoundTrips& trips, const AddValue& add) {
  std::uint64_t below = 0;
  for (std::size_t octave = 0; octave + 1 < kOctaves; ++octave) {
    for (std::size_t i = 0; i < 4; ++i) below += trips.buckets()[octave * 4 + i];
    add(fmt::format("le=\"{}\"", Seconds(bus::RoundTrips::UpperEdge(octave * 4 + 3))),
        static_cast<double>(below), "_bucket");
  }
  const auto count = static_cast<double>(trips.count());
  add("le=\"+Inf\"", count, "_bucket");
  add("", Seconds(trips.mean()) * count, "_sum");
  add("", count, "_count");
}

}  // namespace baudgate::outputs
