// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan/judge.h"

#include <algorithm>
#include <bit>

#include "protocols/assembler.h"

namespace baudgate::scan {
namespace {

constexpr std::uint8_t kParityBit = 0x80;

/// Whole frames among the bytes.
std::vector<Bytes> Frames(const Tongue& tongue, std::size_t mode, View request, View bytes) {
  Assembler assembler;
  assembler.Begin(tongue.protocol->reply_rule,
                  tongue.protocol->expect(request, tongue.options[mode]));
  assembler.Feed(bytes);
  std::vector<Bytes> frames;
  while (auto frame = assembler.Next(false)) frames.push_back(std::move(*frame));
  while (auto frame = assembler.Next(true)) frames.push_back(std::move(*frame));
  return frames;
}

/// What the frames among the bytes say, the strongest of them; empty: none says anything.
std::optional<Verdict> FromFrames(const Tongue& tongue, std::size_t mode, View request,
                                  View bytes) {
  std::optional<Verdict> verdict;
  std::size_t devices = 0;
  for (const Bytes& frame : Frames(tongue, mode, request, bytes)) {
    Sighting sighting = tongue.rule().judge(request, frame, mode);
    if (sighting.what == Sighting::What::nothing) continue;
    const bool device = sighting.what == Sighting::What::device;
    if (device) ++devices;
    if (verdict && (verdict->what == Verdict::What::device || !device)) continue;
    verdict.emplace();
    verdict->what = device ? Verdict::What::device : Verdict::What::maybe;
    verdict->sighting = std::move(sighting);
  }
  if (verdict) verdict->doubled = devices > 1;
  return verdict;
}

/// Which parity the eighth bits of all bytes are; empty: they are none, or there are too few.
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
  if (found->what == Recognised::What::other_master) verdict.what = Verdict::What::foreign;
  if (found->what == Recognised::What::other_device) verdict.what = Verdict::What::other;
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
    // The reply itself may look like this; what follows is somebody else's.
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
      // Any request of ours will do: it has not been sent.
      const Bytes own = tongue.rule().ask(tongue.rule().last_address, 0, 0);
      const auto found = tongue.protocol->recognise(own, bytes, tongue.options[0]);
      if (!found || found->what != Recognised::What::other_master) continue;
      return {true, found->cause + " (" + std::string(tongue.protocol->name) + ", " +
                        format.ToString() + ")"};
    }
  }
  return {false, "somebody sends on this line, " + std::to_string(heard.size()) +
                     " characters were heard at " + std::to_string(serial.baud) + " bit/s"};
}

}  // namespace baudgate::scan
