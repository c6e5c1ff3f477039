// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/traffic_view.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string ShareText(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return "-";
  return fmt::format("{:.1f} %", 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

bool IsAlive(const Json& device) {
  const std::string state = Text(device, "state");
  return state == "online" || state == "degraded";
}

bool IsEchoLost(const Json& line) {
  return line.contains("echo_lost_since") && !line.at("echo_lost_since").is_null();
}

void MostTroubleFirst(std::vector<TableRow>& rows) {
  std::ranges::stable_sort(rows, std::ranges::greater(), &TableRow::tone);
}

}  // namespace

std::string MillisecondsText(const Json& json) {
  return json.is_null() ? "-" : FormatAge(std::chrono::milliseconds(json.get<std::int64_t>()));
}

std::string RoundTripText(double us) {
  if (us < 9'950) return fmt::format("{:.1f} ms", us / 1e3);
  if (us < 999'500) return fmt::format("{:.0f} ms", us / 1e3);
  return fmt::format("{:.1f} s", us / 1e6);
}

std::string UseText(const Json& line) {
  return fmt::format("{:.0f} %", 100 * line.at("use").get<double>());
}

bool InMaintenance(const Json& device) { return !device.at("maintenance").is_null(); }

std::size_t Counted(const Json& line) {
  return static_cast<std::size_t>(
      std::ranges::count_if(line.at("devices"), std::not_fn(InMaintenance)));
}

std::size_t Alive(const Json& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line.at("devices"), [](const Json& device) {
    return !InMaintenance(device) && IsAlive(device);
  }));
}

Tone ToneOfLine(const Json& line) {
  if (Text(line, "port_state") == "closed" || IsEchoLost(line)) return Tone::alarm;
  return line.at("advice").empty() ? Tone::plain : Tone::warning;
}

Tone ToneOfDevice(const Json& device) {
  if (InMaintenance(device)) return Tone::faint;
  if (!IsAlive(device)) return Tone::alarm;
  return device.at("advice").empty() ? Tone::plain : Tone::warning;
}

std::string LineTable(const Json& lines, const TableView& view, Order order) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "line"},
      {.title = "port"},
      {.title = "use", .right = true},
      {.title = "exchanges", .right = true},
      {.title = "no reply", .right = true},
      {.title = "corrupt", .right = true, .spare = true},
      {.title = "late", .right = true, .spare = true},
      {.title = "online", .right = true}};
  std::vector<TableRow> rows;
  for (const Json& line : lines) {
    const std::string port = Text(line, "port_state") + (IsEchoLost(line) ? ", no echo" : "");
    const Json& outcomes = line.at("outcomes");
    rows.push_back({{Text(line, "name"), port, UseText(line), NumberText(line, "exchanges"),
                     NumberText(outcomes, "no_reply"), NumberText(outcomes, "corrupt"),
                     NumberText(line, "late"), fmt::format("{} of {}", Alive(line), Counted(line))},
                    ToneOfLine(line)});
  }
  if (order == Order::trouble) MostTroubleFirst(rows);
  return RenderTable(kColumns, rows, view);
}

std::string DeviceTable(const Json& lines, const TableView& view, Order order) {
  static const std::vector<TableColumn> kColumns = {
      {.title = "device"},
      {.title = "state"},
      {.title = "last"},
      {.title = "answered", .right = true},
      {.title = "ok", .right = true},
      {.title = "mean", .right = true, .spare = true},
      {.title = "p99", .right = true},
      {.title = "retries", .right = true, .spare = true},
      {.title = "missed", .right = true, .spare = true}};
  std::vector<TableRow> rows;
  for (const Json& line : lines) {
    for (const Json& device : line.at("devices")) {
      const Json& trips = device.at("round_trips");
      const bool none = Number(trips, "count") == 0;
      rows.push_back({{Text(line, "name") + "." + Text(device, "name"),
                       InMaintenance(device) ? Text(device, "maintenance") : Text(device, "state"),
                       InWords(Text(device, "last_outcome")), MillisecondsText(device.at("age_ms")),
                       ShareText(Number(device.at("outcomes"), "ok"), Number(device, "exchanges")),
                       none ? "-" : RoundTripText(trips.at("mean_us").get<double>()),
                       none ? "-" : RoundTripText(trips.at("p99_us").get<double>()),
                       NumberText(device, "retries"), NumberText(device, "missed")},
                      ToneOfDevice(device)});
    }
  }
  if (order == Order::trouble) MostTroubleFirst(rows);
  return RenderTable(kColumns, rows, view);
}

namespace {

using Json = nlohmann::ordered_json;

const Json& DdsOf(const Json& status) { return PartOf(status, "dds"); }

/// Returns the key that sorts the advice on devices, causes before consequences: first devices that
/// do not answer, then devices with the most failures among their latest exchanges.
std::pair<bool, std::uint64_t> FailsOf(const Json* device) {
  const Json& recent = PartOf(*device, "recent");
  const bool known = recent.is_object();
  return {ToneOfDevice(*device) == Tone::alarm,
          known ? Number(recent, "exchanges") - Number(recent, "ok") : 0};
}

}  // namespace

std::string HeadSentence(const Json& status) {
  const Json& lines = status.at("lines");
  std::size_t devices = 0;
  std::size_t counted = 0;
  std::size_t alive = 0;
  for (const Json& line : lines) {
    devices += line.at("devices").size();
    counted += Counted(line);
    alive += Alive(line);
  }
  const std::size_t apart = devices - counted;
  return fmt::format("{}: baudgate {}, up {}, lines: {}, devices: {}, online: {}{}",
                     Text(status, "gateway"), Text(status, "version"),
                     MillisecondsText(status.at("uptime_ms")), lines.size(), devices, alive,
                     apart > 0 ? fmt::format(", in maintenance: {}", apart) : "");
}

/// Returns "3 subscribers". If the topics have different numbers, returns for example "3
/// subscribers of points, 3 of devices, none of events, none of alarms".
std::string Subscribers(const Json& dds) {
  const std::uint64_t points = Number(dds, "subscribers");
  std::string text = Plural(points, "subscriber");
  std::string others;
  bool equal = true;
  for (const auto& [topic, readers] : PartOf(dds, "readers").items()) {
    if (topic == "points") continue;
    const std::uint64_t count = readers;
    equal = equal && count == points;
    others += fmt::format(", {} of {}", count == 0 ? "none" : std::to_string(count), topic);
  }
  return equal ? text : text + " of points" + others;
}

std::string DdsSentence(const Json& status) {
  const Json& dds = DdsOf(status);
  if (dds.is_null() || !dds.at("advice").empty()) return {};
  const std::uint64_t refused = Number(dds, "refused");
  return fmt::format("DDS domain {}: {}, {}{}{}", Number(dds, "domain"), Subscribers(dds),
                     Plural(Number(dds, "samples"), "sample"),
                     refused == 0 ? "" : fmt::format(", {} refused by the DDS library", refused),
                     Text(dds, "state") == "starting" ? ", the DDS process is starting" : "");
}

std::vector<std::string> DdsTraffic(const Json& status) {
  const Json& dds = DdsOf(status);
  if (dds.is_null()) return {};
  std::vector<std::string> sentences;
  for (const char* part : {"events", "requests", "datagrams"}) {
    const auto found = dds.find(part);  // an older gateway does not send these members
    if (found == dds.end() || found->is_null() || Text(*found, "text").empty()) continue;
    sentences.push_back("DDS " + Harmless(Text(*found, "text")));
  }
  return sentences;
}

std::string AlarmsSentence(const Json& status) {
  const Json& alarms = PartOf(PartOf(status, "events"), "alarms");
  if (!alarms.is_object()) return {};
  const std::uint64_t active = Number(alarms, "active");
  const std::uint64_t unseen = Number(alarms, "unacknowledged");
  if (active + unseen == 0) return {};
  return fmt::format("{} active, {} not acknowledged: see 'baudgate alarms'",
                     Plural(active, "alarm"), unseen);
}

std::vector<std::string> AdviceOf(const Json& status) {
  const Json& lines = status.at("lines");
  std::vector<std::string> sentences;
  const auto add = [&sentences](const std::string& who, const Json& of) {
    for (const Json& sentence : of.at("advice")) {
      sentences.push_back(Harmless(who + ": " + sentence.get<std::string>()));
    }
  };
  for (const Json& line : lines) {
    add(Text(line, "name"), line);
    std::vector<const Json*> devices;
    for (const Json& device : line.at("devices")) devices.push_back(&device);
    std::ranges::stable_sort(devices, std::ranges::greater{}, FailsOf);
    for (const Json* device : devices) {
      add(Text(line, "name") + "." + Text(*device, "name"), *device);
    }
  }
  const Json& modbus = PartOf(status, "modbus");
  for (const Json& master : PartOf(modbus, "masters"))
    add("master on " + Text(master, "port"), master);
  for (const Json& listener : PartOf(modbus, "closed")) {
    add("listener " + Text(listener, "listener"), listener);
  }
  for (const Json& listener : PartOf(modbus, "other_framing")) {
    add("listener " + Text(listener, "listener"), listener);
  }
  for (const Json& route : PartOf(modbus, "routes")) {
    add("route " + Text(route, "units") + " to " + Text(route, "target"), route);
  }
  for (const auto& [name, section] : status.items()) {
    if (section.is_object() && section.contains("advice"))
      add(name == "dds" ? "DDS" : name, section);
  }
  return sentences;
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kBarWidth = 40;
/// The upper limit of the chart's first row, in µs. Each row covers twice the range of the row
/// above.
constexpr double kFirstRowUs = 64;

/// Returns for example "12345: ok 12300, no_reply 45": the number of exchanges, and how many had
/// each outcome.
std::string ExchangesText(const Json& of) {
  std::string text;
  for (const auto& [outcome, count] : of.at("outcomes").items()) {
    if (count.get<std::uint64_t>() == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? ": " : ", ", InWords(outcome),
                        count.get<std::uint64_t>());
  }
  return NumberText(of, "exchanges") + text;
}

/// Returns the counters for which `labels` contains a label. Example: "retries 3, missed periods 2,
/// late 4 (by up to 80 ms)".
std::string LabelledText(const Json& labels, const Json& of) {
  std::string text;
  for (const auto& [key, label] : labels.items()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", label.get<std::string>(),
                        NumberText(of, key.c_str()));
    if (key == "late" && Number(of, "late") > 0 && of.contains("lateness_ms")) {
      text += fmt::format(" (by up to {} ms)", Number(of, "lateness_ms"));
    }
  }
  return text;
}

std::string Facts(const std::vector<std::pair<std::string, std::string>>& facts,
                  const TableView& view) {
  constexpr std::size_t kLabels = 14;
  std::string text;
  for (const auto& [label, fact] : facts) {
    text += WrapSentence(fmt::format("  {:<12}{}", label, Harmless(fact)), view.width, kLabels);
  }
  return text;
}

/// Returns a bar chart with one row for each doubling of the measured round trip times.
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
         (none ? "" : "\n" + devices) + RenderTraffic(PartOf(status, "modbus"), view) +
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
                                 protocol.empty() ? "serial server" : protocol, Text(line, "port"),
                                 is_serial ? ", " + Text(line, "serial") : "");
  text +=
      Facts({{"port", PortText(line)},
             {"use", fmt::format("{} of the last full minute; since the start, busy {} of {}",
                                 UseText(line), MillisecondsText(line.at("busy_ms")),
                                 MillisecondsText(status.at("uptime_ms")))},
             {"exchanges", ExchangesText(line)},
             {"bytes", fmt::format("{} in, {} out, {} stray", Number(line, "bytes_in"),
                                   Number(line, "bytes_out"), Number(line, "stray_bytes"))},
             {"trouble", LabelledText(status.at("labels").at("line"), line)},
             {"absent", line.at("notice_bound_ms").is_null()
                            ? "no device"
                            : fmt::format("probed {}; a new answer is noticed within {}",
                                          Plural(line.at("probes").get<std::uint64_t>(), "time"),
                                          MillisecondsText(line.at("notice_bound_ms")))}},
            view);
  text += Facts(PortFacts(line), view);
  text += "\n" + Chart(line.at("round_trips"));
  if (!line.at("devices").empty()) text += "\n" + DeviceTable(lines, view);
  return text + RenderTraffic(PartOf(status, "modbus"), view) + AdviceText(status, view);
}

std::string ShownOf(const Json& value) {
  const std::string shown = Text(value, "shown");
  return shown.empty() ? "-" : shown;
}

/// Returns for example "quiet 5.2 ms, reply 1000 ms (line), …". Brackets contain the source of a
/// time that is not the protocol's default.
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

/// Returns "; 3 write only"; empty: there are none.
std::string Apart(const Json& points, const char* key, std::string_view word) {
  const std::uint64_t count = Number(points, key);
  return count == 0 ? "" : fmt::format("; {} {}", count, word);
}

std::vector<PointRow> PointRowsOf(const Json& device) {
  std::vector<PointRow> rows;
  for (const Json& value : device.at("values")) {
    PointRow row{Text(device, "name"),
                 Text(value, "point"),
                 ShownOf(value),
                 Text(value, "unit"),
                 Quality::OfWord(static_cast<std::uint16_t>(Number(value, "quality"))),
                 {},
                 false,
                 Text(value, "quality_text") == "write only"};
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
  // An older gateway does not send this member.
  const std::string learned = device.value("learned", std::string());
  std::string text =
      fmt::format("{}.{}: {}, address {}{}\n", Text(lines.at(0), "name"), Text(device, "name"),
                  Text(device, "protocol"), Text(device, "address"),
                  Text(device, "profile").empty() ? "" : ", profile " + Text(device, "profile"));
  text += Facts(
      {{"state", Text(device, "state_text")},
       {"last", InWords(Text(device, "last_outcome")) +
                    (reason.empty() ? "" : "; last trouble: " + reason)},
       {"answered",
        device.at("age_ms").is_null() ? "never" : MillisecondsText(device.at("age_ms")) + " ago"},
       {"exchanges", ExchangesText(device)},
       {"trouble", LabelledText(status.at("labels").at("device"), device)},
       {"points",
        fmt::format("{}: {} good, {} uncertain, {} bad", Number(points, "count"),
                    Number(points, "good"), Number(points, "uncertain"), Number(points, "bad")) +
            Apart(points, "maintenance", "in maintenance") +
            Apart(points, "write_only", "write only")}},
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

}  // namespace baudgate::tools
