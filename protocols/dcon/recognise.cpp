// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/recognise.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "gateway/base/text.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::string_view kAsks = "$#%@~^";
constexpr std::string_view kAnswers = ">!?";

/// "$01A1".
constexpr std::size_t kLongestRead = 5;
constexpr std::size_t kChecksumDigits = 2;

bool IsText(std::string_view line) {
  return std::ranges::all_of(line, [](char c) { return c >= 0x20 && c < 0x7F; });
}

Recognised OtherChecksum(bool carried) {
  return {Recognised::What::other_setting,
          carried ? "its replies carry a checksum" : "its replies carry no checksum",
          std::string("set checksum: ") + (carried ? "true" : "false") +
              " in the configuration, or the other way round in the module"};
}

/// A whole reply without a checksum, and not one whose checksum is wrong: a bare acknowledgement,
/// or numbers of the module's width and nothing behind them.
bool IsBare(std::string_view line, std::string_view asked, std::size_t width) {
  if (line[0] != '>') return line.size() == 3 && line.substr(1, 2) == asked.substr(1, 2);
  if (width == 0 || line.size() <= width || (line[1] != '+' && line[1] != '-')) return false;
  return (line.size() - 1) % width == 0;
}

/// ">03+01.234" where ">+01.234" is awaited.
bool CarriesAddress(std::string_view line, std::string_view asked) {
  return line[0] == '>' && line.size() > 3 && line.substr(1, 2) == asked.substr(1, 2) &&
         (line[3] == '+' || line[3] == '-');
}

std::optional<Recognised> OfLine(std::string_view line, std::string_view asked,
                                 const Settings& settings) {
  const bool checksum = settings.checksum;
  const auto lead = line.find_first_of(std::string(kAsks) + std::string(kAnswers));
  if (lead == std::string_view::npos) return std::nullopt;
  line.remove_prefix(lead);
  if (line.size() < 3 || !IsText(line)) return std::nullopt;
  if (kAsks.find(line[0]) != std::string_view::npos) {
    // Without a checksum a damaged reply may look like a request: no command to read is long.
    const bool plain = checksum ? ChecksumFits(line, kChecksum) : line.size() <= kLongestRead;
    if (line == asked || !plain || !ParseInteger<int>(line.substr(1, 2), 16)) return std::nullopt;
    return Recognised{Recognised::What::other_master,
                      "another master speaks on the line: it has sent '" + std::string(line) + "'",
                      "a serial line has one master: take the other one away"};
  }
  const bool fits = line.size() > 3 && ChecksumFits(line, kChecksum);
  if (fits && !checksum) return OtherChecksum(true);
  if (!fits && checksum && line.size() > 4 && ChecksumFits(line.substr(1), kChecksum)) {
    return Recognised{Recognised::What::other_setting,
                      "its checksum leaves out the '" + std::string(line.substr(0, 1)) + "'",
                      "update its firmware, or set checksum: false here and in the module"};
  }
  if (!fits && checksum && IsBare(line, asked, settings.width)) return OtherChecksum(false);
  if (!settings.data_address && fits == checksum && CarriesAddress(line, asked)) {
    return Recognised{Recognised::What::other_setting, "its replies with '>' carry its address",
                      "set data_address: true in the configuration"};
  }
  if (line[0] != '>' && line.substr(1, 2) != asked.substr(1, 2) && fits == checksum) {
    return Recognised{Recognised::What::other_device,
                      "module " + std::string(line.substr(1, 2)) + " answers where " +
                          std::string(asked.substr(1, 2)) + " was asked",
                      "check the address that is set in the module"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  std::string_view asked = AsText(request);
  if (asked.size() < 4) return std::nullopt;
  asked.remove_suffix(1);
  std::string_view text = AsText(heard);
  for (auto end = text.find('\r'); end != std::string_view::npos; end = text.find('\r')) {
    if (auto found = OfLine(text.substr(0, end), asked, settings)) {
      return found;
    }
    text.remove_prefix(end + 1);
  }
  return std::nullopt;
}

std::optional<std::string> ForeignDcon(View heard) {
  std::string_view text = AsText(heard);
  for (auto end = text.find('\r'); end != std::string_view::npos; end = text.find('\r')) {
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    const auto lead = line.find_last_of(kAsks);
    if (lead == std::string_view::npos) continue;
    line.remove_prefix(lead);
    const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F'); };
    const bool fits = line.size() >= 3 && line.size() <= kLongestRead + kChecksumDigits;
    if (!fits || !IsText(line) || !is_digit(line[1]) || !is_digit(line[2])) continue;
    return "requests of DCON come ('" + std::string(line) + "')";
  }
  return std::nullopt;
}

}  // namespace baudgate::protocols::dcon
