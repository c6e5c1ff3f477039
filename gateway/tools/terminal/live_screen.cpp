// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/live_screen.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace baudgate {
namespace {

constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[2J";  // alternate screen, no cursor
constexpr std::string_view kLeave = "\x1b[?25h\x1b[?1049l";

/// From the upper left corner on; the rest of each line, and all below, is cleared. The last line
/// has no end: it would scroll.
std::string FrameOf(std::string_view lines, std::size_t height) {
  auto left = static_cast<std::size_t>(std::ranges::count(lines, '\n'));
  if (!lines.empty() && lines.back() != '\n') ++left;
  std::size_t room = height == 0 ? left : height;
  std::string frame = "\x1b[H";
  for (std::size_t at = 0; left > 0 && room > 0; --left, --room) {
    if (at > 0) frame += '\n';
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    const bool cut = room == 1 && left > 1;
    frame += cut ? "… " + std::to_string(left) + " more" : std::string(lines.substr(at, end - at));
    frame += "\x1b[K";
    at = end + 1;
  }
  return frame + "\x1b[J";
}

}  // namespace

Status LiveScreen::Possible(int descriptor) {
  if (::isatty(descriptor) == 0) return Error{"standard output is no terminal"};
  const char* const name = std::getenv("TERM");
  const std::string_view term = name == nullptr ? "" : name;
  if (!term.empty() && term != "dumb") return {};
  return Error{"this terminal cannot be drawn on (TERM is " +
               (term.empty() ? "not set" : std::string(term)) + ")"};
}

LiveScreen::LiveScreen(std::ostream& out) : out_(out) { out_ << kEnter << std::flush; }

LiveScreen::~LiveScreen() { out_ << kLeave << std::flush; }

void LiveScreen::Draw(std::string_view lines, std::size_t height) {
  std::string frame = FrameOf(lines, height);
  if (frame == drawn_) return;
  out_ << frame << std::flush;
  drawn_ = std::move(frame);
}

}  // namespace baudgate
