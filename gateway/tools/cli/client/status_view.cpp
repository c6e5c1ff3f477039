// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/client/json_fields.h"
#include "gateway/tools/cli/client/port_text.h"
#include "gateway/tools/cli/client/status_sentences.h"
#include "gateway/tools/cli/client/status_tables.h"
#include "gateway/tools/cli/client/traffic_view.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBarWidth = 40;
/// The first row of the chart ends here; each row is twice as long as the one before.
constexpr double kFirstRowUs = 64;

/// "12345: ok 12300, no_reply 45".
std::string ExchangesText(const Json& of) {
  std::string text;
  for (const auto& [outcome, count] : of.at("outcomes").items()) {
    if (count.get<std::uint64_t>() == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? ": " : ", ", outcome, count.get<std::uint64_t>());
  }
  return NumberText(of, "exchanges") + text;
}

/// Lines "label  text", the labels in one column.
std::string Facts(const std::vector<std::pair<std::string, std::string>>& facts,
                  const TableView& view) {
  constexpr std::size_t kLabels = 14;
  std::string text;
  for (const auto& [label, fact] : facts) {
    text += WrapSentence(fmt::format("  {:<12}{}", label, Harmless(fact)), view.width, kLabels);
  }
  return text;
}

/// A bar for every doubling of the round trip time, from the shortest seen to the longest.
std::string Chart(const Json& trips) {
  std::map<int, std::uint64_t> rows;
  for (const Json& bucket : trips.at("histogram")) {
    const double up_to = static_cast<double>(Number(bucket, "up_to_us"));
    const double octave = std::ceil(std::log2(up_to / kFirstRowUs) - 0.01);
    rows[static_cast<int>(octave)] += Number(bucket, "count");
  }
  if (rows.empty()) return "  round trips: none yet\n";
  std::string text = fmt::format("  round trips: mean {}, half within {}, 99 % within {}\n",
                                 RoundTripText(trips.at("mean_us").get<double>()),
                                 RoundTripText(trips.at("p50_us").get<double>()),
                                 RoundTripText(trips.at("p99_us").get<double>()));
  std::uint64_t most = 0;
  for (const auto& [octave, count] : rows) most = std::max(most, count);
  for (int octave = rows.begin()->first; octave <= rows.rbegin()->first; ++octave) {
    const std::uint64_t count = rows[octave];
    const double share = static_cast<double>(count) / static_cast<double>(most);
    const auto bar = static_cast<std::size_t>(std::ceil(kBarWidth * share));
    text +=
        fmt::format("  up to {:>7}  {:<40}  {}\n", RoundTripText(kFirstRowUs * std::exp2(octave)),
                    std::string(bar, '#'), count);
  }
  return text;
}

/// After an empty line; nothing where there is none.
std::string Paragraph(const std::vector<std::string>& sentences, const TableView& view) {
  std::string text;
  for (const std::string& sentence : sentences) text += WrapSentence(sentence, view.width);
  return text.empty() ? text : "\n" + text;
}
std::string Paragraph(const std::string& sentence, const TableView& view) {
  return sentence.empty() ? sentence : Paragraph(std::vector{sentence}, view);
}

std::string AdviceText(const Json& status, const TableView& view) {
  const auto is_note = [](const std::string& one) { return one.find(": note: ") != one.npos; };
  std::vector<std::string> sentences = AdviceOf(status);
  std::stable_partition(sentences.begin(), sentences.end(), std::not_fn(is_note));
  const bool well = std::ranges::all_of(sentences, is_note);
  return (well ? "\nall is well\n" : "") + Paragraph(sentences, view);
}

std::string DdsText(const Json& status, const TableView& view) {
  std::string text = Paragraph(DdsSentence(status), view);
  const std::string traffic = Paragraph(DdsTraffic(status), view);
  const bool joined = !text.empty() && !traffic.empty();
  return text + (joined ? traffic.substr(1) : traffic);
}

std::string Overview(const Json& status, const TableView& view) {
  const Json& lines = status.at("lines");
  const std::string devices = DeviceTable(lines, view);
  const bool none =
      std::ranges::all_of(lines, [](const Json& line) { return line.at("devices").empty(); });
  return WrapSentence(HeadSentence(status), view.width) + "\n" + LineTable(lines, view) +
         (none ? "" : "\n" + devices) + RenderTraffic(status.at("modbus"), view) +
         DdsText(status, view) + Paragraph(AlarmsSentence(status), view) + AdviceText(status, view);
}

std::string PortText(const Json& line) {
  std::string text = Text(line, "port_state");
  if (!Text(line, "port_text").empty()) text += " (" + Text(line, "port_text") + ")";
  if (!line.at("port_since").is_null()) text += " since " + Text(line, "port_since");
  return text + fmt::format(", lost: {}", Number(line, "times_lost"));
}

std::string OneLine(const Json& status, const TableView& view) {
  const Json& lines = status.at("lines");
  const Json& line = lines.at(0);
  const bool is_serial = !line.at("serial").is_null();
  const std::string protocol = Text(line, "protocol");
  std::string text = fmt::format("{}: {} on {}{}\n", Text(line, "name"),
                                 protocol.empty() ? "clients of its port" : protocol,
                                 Text(line, "port"), is_serial ? ", " + Text(line, "serial") : "");
  text +=
      Facts({{"port", PortText(line)},
             {"use", fmt::format("{} of the last full minute, busy {} of {}", UseText(line),
                                 MillisecondsText(line.at("busy_ms")),
                                 MillisecondsText(status.at("uptime_ms")))},
             {"exchanges", ExchangesText(line)},
             {"bytes", fmt::format("{} in, {} out, {} stray", Number(line, "bytes_in"),
                                   Number(line, "bytes_out"), Number(line, "stray_bytes"))},
             {"trouble", fmt::format("late {}, echoes {}, collisions {}, parity errors {}, framing "
                                     "errors {}, overruns {}",
                                     Number(line, "late"), Number(line, "echoes"),
                                     Number(line, "collisions"), Number(line, "parity_errors"),
                                     Number(line, "framing_errors"), Number(line, "overruns"))},
             {"absent", line.at("notice_bound_ms").is_null()
                            ? "no device"
                            : fmt::format("probed {}; a return is noticed within {}",
                                          Plural(line.at("probes").get<std::uint64_t>(), "time"),
                                          MillisecondsText(line.at("notice_bound_ms")))}},
            view);
  text += Facts(PortFacts(line), view);
  text += "\n" + Chart(line.at("round_trips"));
  if (!line.at("devices").empty()) text += "\n" + DeviceTable(lines, view);
  return text + RenderTraffic(status.at("modbus"), view) + AdviceText(status, view);
}

std::string JsonValueText(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  return value.is_number_float() ? FormatValue(value.get<double>()) : value.dump();
}

/// "quiet 5.2 ms, reply 1000 ms (line), …": the protocol's own stand without a word.
std::string TimesText(const Json& times) {
  std::string text;
  for (const Json& time : times) {
    const std::string from = Text(time, "from");
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", Text(time, "name"),
                        RoundTripText(time.at("ms").get<double>() * 1e3),
                        from == "protocol" ? "" : " (" + from + ")");
  }
  return text;
}

std::vector<PointRow> PointRowsOf(const Json& device) {
  std::vector<PointRow> rows;
  for (const Json& value : device.at("values")) {
    PointRow row{Text(device, "name"),
                 Text(value, "point"),
                 JsonValueText(value.at("value")),
                 Text(value, "unit"),
                 Quality::OfWord(static_cast<std::uint16_t>(Number(value, "quality"))),
                 {},
                 false};
    if (!value.at("age_ms").is_null()) {
      row.age = std::chrono::milliseconds(value.at("age_ms").get<std::int64_t>());
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string OneDevice(const Json& status, const TableView& view) {
  const Json& lines = status.at("lines");
  const Json& device = lines.at(0).at("devices").at(0);
  const Json& points = device.at("points");
  const std::string reason = Text(device, "last_reason");
  const std::string learned = device.value("learned", std::string());  // an older gateway has none
  std::string text =
      fmt::format("{}.{}: {}, address {}{}\n", Text(lines.at(0), "name"), Text(device, "name"),
                  Text(device, "protocol"), Text(device, "address"),
                  Text(device, "profile").empty() ? "" : ", profile " + Text(device, "profile"));
  text += Facts(
      {{"state", Text(device, "state")},
       {"last", Text(device, "last_outcome") + (reason.empty() ? "" : "; last trouble: " + reason)},
       {"answered",
        device.at("age_ms").is_null() ? "never" : MillisecondsText(device.at("age_ms")) + " ago"},
       {"exchanges", ExchangesText(device)},
       {"trouble",
        fmt::format("retries {}, missed periods {}, late {}{}", Number(device, "retries"),
                    Number(device, "missed"), Number(device, "late"),
                    Number(device, "late") == 0
                        ? ""
                        : fmt::format(" (by up to {} ms)", Number(device, "lateness_ms")))},
       {"points",
        fmt::format("{}: {} good, {} uncertain, {} bad", Number(points, "count"),
                    Number(points, "good"), Number(points, "uncertain"), Number(points, "bad"))}},
      view);
  if (!learned.empty()) text += Facts({{"learned", learned}}, view);
  if (!device.value("times", Json::array()).empty())
    text += Facts({{"times", TimesText(device.at("times"))}}, view);
  text += "\n" + Chart(device.at("round_trips")) + "\n";
  return text + RenderPoints(PointRowsOf(device), view) + AdviceText(status, view);
}

}  // namespace

std::string RenderStatus(const Json& status, const std::string& target, const TableView& view) {
  if (target.empty()) return Overview(status, view);
  return target.find('.') == std::string::npos ? OneLine(status, view) : OneDevice(status, view);
}

}  // namespace baudgate
