// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status_watch.h"

#include <unistd.h>

#include <algorithm>
#include <functional>
#include <sstream>
#include <string>

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/status_frame.h"
#include "gateway/tools/cli/client/status_view.h"
#include "gateway/tools/terminal/live_screen.h"
#include "gateway/tools/terminal/stop_signals.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

constexpr Duration kBetweenFrames = 1s;

/// One look at the gateway: its answer, or why there is none.
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

/// Above the last status that came stands why no other comes.
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

/// False: it is to end. A terminal of another size is drawn at once.
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
  while (out) {  // until its reader has left
    draw();
    const Instant next = std::min(ReadClocks().instant + kBetweenFrames, end);
    if (!WaitUntil(next, signals, draw) || next == end) break;
    Look now = LookAt(options);
    look.trouble = now.trouble;
    if (now.code == 0) look.status = std::move(now.status);
  }
  return 0;
}

}  // namespace baudgate
