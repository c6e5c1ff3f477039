// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status.h"

#include <unistd.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <sstream>
#include <utility>

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/terminal/command_end.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kParts = 3;      // a frame has three parts: lines, devices, sentences
constexpr std::size_t kLeastPart = 4;  // height: title, two rows, number of rows left out
constexpr std::size_t kNoLimit = 1000;

/// Returns the sort key of a line: the worst tone among the line and its devices, then the tone of
/// the line itself.
std::pair<Tone, Tone> TroubleOf(const Json& line) {
  Tone worst = ToneOfLine(line);
  for (const Json& device : line.at("devices")) worst = std::max(worst, ToneOfDevice(device));
  return {worst, ToneOfLine(line)};
}

void SortByTrouble(Json& status) {
  Json& lines = status.at("lines");
  for (Json& line : lines) {
    std::stable_sort(
        line.at("devices").begin(), line.at("devices").end(),
        [](const Json& a, const Json& b) { return ToneOfDevice(a) > ToneOfDevice(b); });
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Json& a, const Json& b) { return TroubleOf(a) > TroubleOf(b); });
}

std::string FirstLines(const std::string& text, std::size_t count) {
  std::size_t end = 0;
  while (count-- > 0) end = text.find('\n', end) + 1;
  return text.substr(0, end);
}

/// Returns at most `height` screen lines. If the first sentence does not fit, it is cut; every
/// other sentence is printed whole or left out.
std::string Sentences(const std::vector<std::string>& sentences, std::size_t width,
                      std::size_t height) {
  std::string text;
  std::size_t used = 0;
  for (std::size_t i = 0; i < sentences.size(); ++i) {
    const std::string one = WrapSentence(sentences[i], width);
    const auto lines = static_cast<std::size_t>(std::ranges::count(one, '\n'));
    // One line is needed for the number of sentences left out.
    const std::size_t kept = i + 1 < sentences.size() ? 1 : 0;
    if (used + lines + kept > height && i == 0) {
      return FirstLines(one, height - 1) + "…\n";
    }
    if (used + lines + kept > height) {
      return text + "… " + std::to_string(sentences.size() - i) + " more\n";
    }
    text += one;
    used += lines;
  }
  return text;
}

std::size_t LinesOf(const std::vector<std::string>& sentences, std::size_t width) {
  return std::accumulate(
      sentences.begin(), sentences.end(), std::size_t{0},
      [&](std::size_t sum, const std::string& one) { return sum + WrapLines(one, width).size(); });
}

std::string OtherVersion(const nlohmann::ordered_json& status) {
  return "baudgate: the gateway has another version than this program (" +
         status.value("version", std::string("unknown")) + "); use 'baudgate status --json'";
}

}  // namespace

std::vector<std::size_t> Shares(std::size_t all, const std::vector<std::size_t>& wanted) {
  std::vector<std::size_t> order(wanted.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return wanted[i]; });
  std::vector<std::size_t> shares(wanted.size());
  for (std::size_t done = 0; done < order.size(); ++done) {
    const std::size_t fair = all / (order.size() - done);
    shares[order[done]] = std::min(wanted[order[done]], fair);
    all -= shares[order[done]];
  }
  return shares;
}

std::string RenderStatusFrame(const Json& status, const TableView& view) {
  Json sorted = status;
  SortByTrouble(sorted);
  const Json& lines = sorted.at("lines");
  std::size_t devices = 0;
  for (const Json& line : lines) devices += line.at("devices").size();
  std::vector<std::string> sentences = AdviceOf(sorted);
  if (const std::string alarms = AlarmsSentence(sorted); !alarms.empty()) {
    sentences.insert(sentences.begin(), alarms);
  }
  if (sentences.empty()) sentences.emplace_back("all is well");

  const std::string head = WrapSentence(HeadSentence(sorted), view.width);
  const auto above = static_cast<std::size_t>(std::ranges::count(head, '\n')) + kParts;
  const std::size_t room = view.height == 0 ? kNoLimit : view.height - std::min(view.height, above);
  const bool small = room < kParts * kLeastPart;  // on a small terminal, only the devices are shown
  const auto shares = Shares(room, {small ? 0 : lines.size() + 1, devices == 0 ? 0 : devices + 1,
                                    LinesOf(sentences, view.width)});
  const auto part = [&](std::size_t height) { return TableView{view.width, height, view.colour}; };
  std::string text = head;
  if (shares[0] > 0) text += "\n" + LineTable(lines, part(shares[0]), Order::trouble);
  if (shares[1] > 0) text += "\n" + DeviceTable(lines, part(shares[1]), Order::trouble);
  if (shares[2] > 0) text += "\n" + Sentences(sentences, view.width, shares[2]);
  return text;
}

namespace {

using Json = ControlClient::Json;

constexpr Duration kBetweenFrames = 1s;

struct Look {
  int code = 0;
  Json status;
  std::string trouble;
};

Look LookAt(const StatusOptions& options) {
  Look look;
  std::ostringstream told;
  Json request = {{"command", "status"}};
  if (!options.target.empty()) request["target"] = options.target;
  look.code = Ask(options.socket, request, look.status, told);
  look.trouble = told.str();
  return look;
}

std::string Frame(const Json& status, const std::string& target, const TableView& view) {
  try {
    if (target.empty()) return RenderStatusFrame(status, view);
    return RenderStatus(status, target, {.width = view.width, .colour = view.colour});
  } catch (const Json::exception&) {
    return OtherVersion(status) + "\n";
  }
}

/// Draws the last status that was received and, above it, the reason why there is no newer status.
void Draw(const Look& look, const StatusOptions& options, LiveScreen& screen) {
  TableView view = TerminalView(STDOUT_FILENO).value_or(*options.terminal);
  const std::size_t height = view.height;
  std::string above;
  if (!look.trouble.empty()) {
    above = WrapSentence(look.trouble.substr(0, look.trouble.find('\n')), view.width) + "\n";
    const auto lines = static_cast<std::size_t>(std::ranges::count(above, '\n'));
    if (height > 0) view.height -= std::min(height - 1, lines);
  }
  screen.Draw(above + Frame(look.status, options.target, view), height);
}

/// Returns false at a signal to stop. If the terminal was resized, calls `draw` at once.
bool WaitUntil(Instant until, const StopSignals& signals, const std::function<void()>& draw) {
  for (Instant now = ReadClocks().instant; now < until; now = ReadClocks().instant) {
    if (!signals.Wait(until - now)) continue;
    if (signals.Came()) return false;
    draw();
  }
  return true;
}

}  // namespace

int RunStatusWatch(const StatusOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals(StopSignals::And::resize);
  Instant end = Instant::max();
  if (options.seconds) end = ReadClocks().instant + *options.seconds;
  Look look = LookAt(options);
  if (look.code != 0) {
    err << look.trouble;
    return look.code;
  }
  LiveScreen screen(out);
  const auto draw = [&] { Draw(look, options, screen); };
  while (out) {  // `out` fails when the program that reads it has closed it
    draw();
    const Instant next = std::min(ReadClocks().instant + kBetweenFrames, end);
    if (!WaitUntil(next, signals, draw) || next == end) break;
    Look now = LookAt(options);
    look.trouble = now.trouble;
    if (now.code == 0) look.status = std::move(now.status);
  }
  return 0;
}

namespace {

constexpr int kNotUnderstood = 4;

}  // namespace

int RunStatus(const StatusOptions& options, std::ostream& out, std::ostream& err) {
  ControlClient::Json request = {{"command", "status"}};
  if (!options.target.empty()) request["target"] = options.target;
  ControlClient::Json status;
  if (const int code = Ask(options.socket, request, status, err); code != 0) return code;
  if (options.json) {
    out << status.dump(2, ' ', false, ControlClient::Json::error_handler_t::replace) << '\n';
    return 0;
  }
  TableView view = options.terminal.value_or(TableView{});
  view.height = 0;  // the status is printed once, so its height has no limit
  try {
    out << RenderStatus(status, options.target, view);
  } catch (const ControlClient::Json::exception&) {
    err << OtherVersion(status) << '\n';
    return kNotUnderstood;
  }
  return 0;
}

}  // namespace baudgate::tools
