// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/scan_view.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>

#include "gateway/tools/terminal/text_table.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

constexpr Duration kDrawEvery = 100ms;
constexpr const char* kStartOfLine = "\r\x1b[K";

std::string TimeLeft(Duration left) {
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(left).count();
  if (seconds < 90) return fmt::format("{} s", seconds);
  return fmt::format("{} min", (seconds + 59) / 60);
}

std::string Joined(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : "; ") + sentence;
  return text;
}

Json ToJson(const scan::Found& found, bool network) {
  return {
      {"protocol", found.protocol}, {"serial", network ? Json() : Json(found.serial.ToString())},
      {"address", found.address},   {"identity", found.identity},
      {"profile", found.profile},   {"unit", found.unit},
      {"suspect", found.suspect},   {"remarks", found.remarks}};
}

}  // namespace

bool HasUser() { return isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1; }

bool AskUser(const std::string& question, const StopSignals& stop, std::ostream& err) {
  if (!HasUser()) return false;
  err << question << " [y/N] " << std::flush;
  std::array<pollfd, 2> waited = {pollfd{STDIN_FILENO, POLLIN, 0},
                                  pollfd{stop.descriptor(), POLLIN, 0}};
  if (::poll(waited.data(), waited.size(), -1) < 1 || waited[1].revents != 0) return false;
  char answer[64];
  const ssize_t size = ::read(STDIN_FILENO, answer, sizeof answer);
  return size > 0 && (answer[0] == 'y' || answer[0] == 'Y');
}

ScanView::ScanView(const ScanOptions& options, bool network, const StopSignals& stop,
                   std::function<void()> alive, std::ostream& out, std::ostream& err)
    : options_(options),
      network_(network),
      stop_(stop),
      alive_(std::move(alive)),
      out_(out),
      err_(err),
      terminal_(isatty(STDERR_FILENO) == 1) {}

void ScanView::Clear() {
  if (std::exchange(drawn_, false)) err_ << kStartOfLine << std::flush;
}

void ScanView::OnProgress(const scan::Progress& progress) {
  alive_();
  const Instant now = ReadClocks().instant;
  if (!terminal_ || now - drawn_at_ < kDrawEvery) return;
  drawn_at_ = now;
  drawn_ = true;
  err_ << kStartOfLine << progress.doing << "; found " << progress.found << "; "
       << TimeLeft(progress.left) << " left, Ctrl-C ends it" << std::flush;
}

void ScanView::OnFound(const scan::Found& found) {
  if (options_.json) {
    Clear();
    const Json json = ToJson(found, network_);
    out_ << json.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  } else if (terminal_) {
    Clear();
    err_ << found.protocol << ' ' << found.serial.ToString() << ", address " << found.address
         << ": " << (found.identity.empty() ? "a device" : found.identity) << '\n';
  }
}

bool ScanView::MayTalk(const std::string& who) {
  Clear();
  if (options_.over_traffic) return true;
  const std::string why = who + "; a scan disturbs it";
  if (AskUser("baudgate: " + why + ". Go on all the same?", stop_, err_)) return true;
  refused_ = true;
  if (!HasUser()) {
    err_ << "baudgate: " << options_.target << ": " << why
         << ": take it off the line, or allow it with --over-traffic\n";
  }
  return false;
}

void ScanView::Conclude(const scan::Report& report) {
  Clear();
  if (refused_ && report.found.empty()) return;
  if (!options_.json && report.found.empty() && report.asked) {
    out_ << "No device has answered. Is the adapter the right one ('baudgate ports'), are A and B "
            "swapped, is the bus powered?\n";
  }
  if (!options_.json && !report.found.empty()) {
    config::TextTable table(
        {"protocol", "serial", "address", "identity", "profile", "unit", "remarks"});
    for (const scan::Found& found : report.found) {
      table.Add({found.protocol, network_ ? "" : found.serial.ToString(),
                 std::to_string(found.address), found.identity,
                 found.profile + (found.assumed ? " (assumed)" : ""), std::to_string(found.unit),
                 Joined(found.remarks)});
    }
    table.PrintAligned(out_, "", options_.width);
  }
  std::ostream& words = options_.json ? err_ : out_;
  for (const std::string& remark : report.remarks) {
    words << WrapSentence(remark + ".", options_.width);
  }
  if (!report.asked && !refused_) {
    words << (report.ended ? "Nothing was asked: no protocol has these addresses.\n"
                           : "The scan ended while it still listened: nothing was asked yet.\n");
  } else if (!report.ended && !refused_) {
    words << "The scan has ended before everything was asked.\n";
  }
}

}  // namespace baudgate
