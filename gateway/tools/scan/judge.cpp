// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan/judge.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <tuple>

#include "config/model/modbus.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"

namespace baudgate::scan {
namespace {

constexpr std::uint8_t kParityBit = 0x80;

std::vector<Bytes> Frames(const Tongue& tongue, std::size_t mode, View request, View bytes) {
  protocols::Assembler assembler;
  assembler.Begin(tongue.protocol->reply_rule,
                  tongue.protocol->expect(request, tongue.options[mode]));
  assembler.Feed(bytes);
  std::vector<Bytes> frames;
  while (auto frame = assembler.Next(false)) frames.push_back(std::move(*frame));
  while (auto frame = assembler.Next(true)) frames.push_back(std::move(*frame));
  return frames;
}

/// Returns the best verdict about the frames: `device`, else `maybe`; empty: no frame gives one.
std::optional<Verdict> FromFrames(const Tongue& tongue, std::size_t mode, View request,
                                  View bytes) {
  std::optional<Verdict> verdict;
  std::size_t devices = 0;
  for (const Bytes& frame : Frames(tongue, mode, request, bytes)) {
    protocols::Sighting sighting = tongue.rule().judge(request, frame, mode);
    if (sighting.what == protocols::Sighting::What::nothing) continue;
    const bool device = sighting.what == protocols::Sighting::What::device;
    if (device) ++devices;
    if (verdict && (verdict->what == Verdict::What::device || !device)) continue;
    verdict.emplace();
    verdict->what = device ? Verdict::What::device : Verdict::What::maybe;
    verdict->sighting = std::move(sighting);
  }
  if (verdict) verdict->doubled = devices > 1;
  return verdict;
}

/// Returns the parity that bit 7 of all bytes represents; empty: bit 7 represents no parity or is
/// never set.
std::optional<config::Parity> ParityOfEighths(View bytes) {
  if (std::ranges::none_of(bytes, [](auto byte) { return (byte & kParityBit) != 0; })) return {};
  const auto odd = static_cast<std::size_t>(
      std::ranges::count_if(bytes, [](auto byte) { return std::popcount(byte) % 2 == 1; }));
  if (odd == 0) return config::Parity::even;
  if (odd == bytes.size()) return config::Parity::odd;
  return std::nullopt;
}

Bytes WithoutEighths(View bytes) {
  Bytes low(bytes.begin(), bytes.end());
  for (std::uint8_t& byte : low) byte &= static_cast<std::uint8_t>(~kParityBit);
  return low;
}

std::optional<Verdict> InSevenBits(const Tongue& tongue, std::size_t mode, View request,
                                   View bytes) {
  if (tongue.protocol->data_bits > 7) return std::nullopt;
  const auto parity = ParityOfEighths(bytes);
  if (!parity) return std::nullopt;
  auto verdict = FromFrames(tongue, mode, request, WithoutEighths(bytes));
  if (verdict) verdict->parity = parity;
  return verdict;
}

std::optional<Verdict> FromOthers(const Tongue& tongue, std::size_t mode, View request,
                                  View bytes) {
  if (tongue.protocol->recognise == nullptr) return std::nullopt;
  const auto found = tongue.protocol->recognise(request, bytes, tongue.options[mode]);
  if (!found) return std::nullopt;
  Verdict verdict;
  if (found->what == protocols::Recognised::What::other_master)
    verdict.what = Verdict::What::foreign;
  if (found->what == protocols::Recognised::What::other_device) verdict.what = Verdict::What::other;
  if (verdict.what == Verdict::What::silence) return std::nullopt;
  verdict.text = found->cause;
  return verdict;
}

bool BeginsWith(View bytes, View start) {
  return bytes.size() >= start.size() && std::ranges::equal(bytes.first(start.size()), start);
}

bool MayMirror(const Tongue& tongue, std::size_t mode, View request) {
  return tongue.protocol->expect(request, tongue.options[mode]).mirrors;
}

}  // namespace

Verdict Judge(const Tongue& tongue, std::size_t mode, View request, const Gathered& gathered) {
  View heard = gathered.heard;
  Verdict verdict;
  const bool back = BeginsWith(heard, request);
  if (back && MayMirror(tongue, mode, request) &&
      !FromFrames(tongue, mode, request, heard.subspan(request.size()))) {
    // A reply can be equal to its request. Bytes after it are then no part of the reply.
    auto alike = FromFrames(tongue, mode, request, heard.first(request.size()));
    if (alike && alike->what == Verdict::What::maybe) return *alike;
  }
  if (back && heard.size() == request.size()) {
    verdict.what = Verdict::What::echo;
    verdict.echoed = true;
    return verdict;
  }
  if (back) heard = heard.subspan(request.size());
  verdict.what = heard.empty() ? Verdict::What::silence : Verdict::What::garbled;
  if (auto found = FromFrames(tongue, mode, request, heard)) {
    verdict = std::move(*found);
  } else if (auto seven = InSevenBits(tongue, mode, request, heard)) {
    verdict = std::move(*seven);
  } else if (auto others = FromOthers(tongue, mode, request, heard)) {
    verdict = std::move(*others);
  } else if (gathered.damaged > 0) {
    verdict.what = Verdict::What::damaged;
  }
  verdict.echoed = back;
  return verdict;
}

Talk WhoTalks(const std::vector<Tongue>& tongues, View heard,
              const config::SerialSettings& serial) {
  for (const bool seven : {false, true}) {
    const auto parity = ParityOfEighths(heard);
    if (seven && !parity) continue;
    const Bytes bytes = seven ? WithoutEighths(heard) : Bytes(heard.begin(), heard.end());
    config::SerialSettings format = serial;
    if (seven) format.data_bits = 7;
    if (seven) format.parity = *parity;
    for (const Tongue& tongue : tongues) {
      if (tongue.protocol->recognise == nullptr) continue;
      // `recognise` needs a request of this program. Nothing was sent yet, so any request will do.
      const Bytes own = tongue.rule().ask(tongue.rule().last_address, 0, 0);
      const auto found = tongue.protocol->recognise(own, bytes, tongue.options[0]);
      if (!found || found->what != protocols::Recognised::What::other_master) continue;
      return {true, found->cause + " (" + std::string(tongue.protocol->name) + ", " +
                        format.ToString() + ")"};
    }
  }
  return {false, "another device sends on this line: " + std::to_string(heard.size()) +
                     " characters came at " + std::to_string(serial.baud) + " bit/s"};
}

namespace {

/// The limit of a label in a host name (RFC 1035).
constexpr std::size_t kLongestName = 63;

std::string FormatOf(const config::SerialSettings& serial) {
  const std::string text = serial.ToString();
  return text.substr(text.find(' ') + 1);
}

/// Returns the most frequent value of `key`; of equally frequent values, the first.
template <typename Key>
auto MostFrequent(const std::vector<Found>& found, Key key) {
  auto best = key(found.front());
  std::ptrdiff_t most = 0;
  for (const Found& one : found) {
    const auto count =
        std::ranges::count_if(found, [&](const Found& other) { return key(other) == key(one); });
    if (count > most) {
      most = count;
      best = key(one);
    }
  }
  return best;
}

std::string Comment(std::string_view text) { return "# " + Printable(ToBytes(text)); }

std::string NameOf(const Found& device, const std::vector<std::string>& taken) {
  std::string base = device.profile.empty() || device.assumed ? device.protocol : device.profile;
  for (char& c : base) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
  }
  const std::string name = base + "-" + std::to_string(device.address);
  for (int more = 2;; ++more) {
    const std::string unique = more == 2 ? name : name + "-" + std::to_string(more - 1);
    if (std::ranges::find(taken, unique) == taken.end()) return unique;
  }
}

std::string DeviceText(const Found& device, const std::string& name, const std::string& protocol,
                       const std::string& serial, bool network) {
  std::string text = "      - name: " + name + "\n";
  const auto add = [&text](const std::string& key, const std::string& value) {
    text += "        " + key + ": " + value + "\n";
  };
  add("address", std::to_string(device.address));
  if (device.protocol != protocol) add("protocol", device.protocol);
  if (!network && device.serial.ToString() != serial) add("serial", device.serial.ToString());
  if (!device.mode.key.empty()) add(std::string(device.mode.key), std::string(device.mode.value));
  if (!device.profile.empty()) add("profile", device.profile);
  if (device.unit != 0) add("unit", std::to_string(device.unit));
  if (device.suspect) add("enabled", "false");
  if (device.profile.empty() && !device.point.empty()) {
    text += "        points:\n          - " + device.point + "\n";
  }
  return text;
}

}  // namespace

unsigned UnitFor(const std::vector<Found>& others, unsigned address) {
  const auto is_free = [&](unsigned unit) {
    return std::ranges::none_of(others, [unit](const Found& one) { return one.unit == unit; });
  };
  if (address >= 1 && address <= config::kLastSlave && is_free(address)) return address;
  for (unsigned unit = 1; unit <= config::kLastSlave; ++unit) {
    if (is_free(unit)) return unit;
  }
  return 0;
}

void RemarkFormats(std::vector<Found>& found) {
  for (Found& one : found) {
    std::map<std::string, int> formats;
    for (const Found& other : found) {
      if (other.protocol == one.protocol && other.serial.baud == one.serial.baud) {
        ++formats[FormatOf(other.serial)];
      }
    }
    const auto usual = std::ranges::max_element(
        formats, [](const auto& a, const auto& b) { return a.second < b.second; });
    const std::string own = FormatOf(one.serial);
    if (usual->first == own || usual->second <= formats[own]) continue;
    one.remarks.push_back("this device uses " + own +
                          ", but most devices of its protocol here use " + usual->first +
                          ": check the character format");
  }
}

std::string GatewayName(std::string_view host) {
  std::string name;
  for (const char c : host.substr(0, host.find('.'))) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      name += c;
    } else if (!name.empty() && std::isalnum(static_cast<unsigned char>(name.back())) != 0) {
      name += c == '_' ? '_' : '-';
    }
  }
  while (!name.empty() && std::isalnum(static_cast<unsigned char>(name.back())) == 0) {
    name.pop_back();
  }
  return name.empty() ? "gateway" : name.substr(0, kLongestName);
}

std::string Configuration(const Report& report, const Heading& heading) {
  std::string text = Comment(heading.written) + "\n";
  for (const std::string& remark : report.remarks) text += Comment(remark) + "\n";
  text += "\ngateway: { name: \"" + heading.gateway + "\" }\n";
  text += "\nmodbus:\n  listen: 127.0.0.1:1502\nweb:\n  listen: 127.0.0.1:8502\n\nlines:\n";
  const auto [protocol, serial] = MostFrequent(report.found, [](const Found& one) {
    return std::tuple(one.protocol, one.serial.ToString());
  });
  text += "  - name: \"" + heading.line + "\"\n    port: " + heading.port + "\n";
  if (!report.network) text += "    serial: " + serial + "\n";
  text += "    protocol: " + protocol + "\n";
  if (report.echo) text += "    echo: strip\n";
  text += "    devices:\n";
  std::vector<std::string> names;
  for (const Found& device : report.found) {
    names.push_back(NameOf(device, names));
    if (!device.identity.empty()) text += "      " + Comment("identity: " + device.identity) + "\n";
    if (device.assumed) {
      text += "      " +
              Comment("the profile is assumed, because the device does not identify itself") + "\n";
    }
    for (const std::string& remark : device.remarks) text += "      " + Comment(remark) + "\n";
    text += DeviceText(device, names.back(), protocol, serial, report.network);
  }
  return text;
}

}  // namespace baudgate::scan
