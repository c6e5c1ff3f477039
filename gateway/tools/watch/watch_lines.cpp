// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch_lines.h"

#include <cmath>

#include "gateway/base/shown.h"

namespace baudgate::tools {
namespace {

std::string_view GoneText(dds::Gone gone) {
  return gone == dds::Gone::disposed ? "disposed" : "no_writers";
}

}  // namespace

WallTime SourceTime(const dds::PointSample& sample) {
  return WallTime(Duration(sample.source_time_ns));
}

Quality QualityOf(const dds::PointSample& sample) { return Quality::OfWord(sample.quality); }

std::string ValueText(const dds::PointSample& sample) {
  if (!sample.text.empty()) return sample.text;
  // A sample does not tell the type of its point, so all whole numbers are shown whole.
  const bool whole = std::isnan(sample.value) || std::trunc(sample.value) == sample.value;
  return whole ? FormatValue(sample.value) : ShownNumber(sample.value);
}

bool LooksAlike(const PointEvent& before, const PointEvent& now) {
  const dds::PointSample& a = before.sample;
  const dds::PointSample& b = now.sample;
  const bool same = a.value == b.value || (std::isnan(a.value) && std::isnan(b.value));
  return before.gone == now.gone && same && a.text == b.text && a.unit == b.unit &&
         a.quality == b.quality;
}

bool IsSameReading(const PointEvent& before, const PointEvent& now) {
  return LooksAlike(before, now) && before.sample.seq == now.sample.seq &&
         before.sample.source_time_ns == now.sample.source_time_ns &&
         before.origin.writer == now.origin.writer;
}

std::string JsonLine(const PointEvent& event) {
  const dds::PointSample& sample = event.sample;
  if (event.gone) {
    Json line = KeyOf(sample);
    line["gone"] = GoneText(*event.gone);
    return Dump(line);
  }
  Json line = JsonOf(sample, [&sample](std::string_view field, Json& made) {
    if (field == "text") {
      if (!sample.text.empty()) made["text"] = sample.text;
    } else if (field == "quality") {
      made["quality"] = sample.quality;
      made["quality_text"] = Name(QualityOf(sample));
    } else {
      return false;
    }
    return true;
  });
  line["writer"] = Text(event.origin.writer);
  return Dump(line);
}

std::string PlainLine(const PointEvent& event) {
  const dds::PointSample& sample = event.sample;
  std::string line = sample.source_time_ns > 0 ? FormatWallTime(SourceTime(sample)) : "-";
  line += "  " + sample.gateway + "  " + sample.device + "  " + sample.point + "  ";
  if (event.gone) return Harmless(line + "gone (" + std::string(GoneText(*event.gone)) + ")");
  line += ValueText(sample);
  if (!sample.unit.empty()) line += " " + sample.unit;
  return Harmless(line + "  " + Name(QualityOf(sample)));
}

}  // namespace baudgate::tools
