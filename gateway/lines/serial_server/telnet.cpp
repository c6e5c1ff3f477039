// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/telnet.h"

#include <algorithm>

namespace baudgate::serial_server {

using namespace telnet;  // NOLINT(google-build-using-namespace): constants of its own header

namespace {

constexpr std::uint8_t kCr = 0x0D;
constexpr std::uint8_t kDataIac[] = {kIac};

}  // namespace

std::optional<TelnetItem> TelnetDecoder::Next(View& input) {
  while (!input.empty()) {
    if (state_ == State::data && input.front() != kIac) {
      if (auto item = TakeData(input)) return item;
      continue;
    }
    const std::uint8_t byte = input.front();
    input = input.subspan(1);
    if (auto item = On(byte)) return item;
  }
  return std::nullopt;
}

/// Returns the data at the front of `input`; nothing if the byte was a 0 behind a CR.
std::optional<TelnetItem> TelnetDecoder::TakeData(View& input) {
  if (!binary_ && after_cr_ && input.front() == 0) {
    after_cr_ = false;
    input = input.subspan(1);
    return std::nullopt;
  }
  auto end = std::find(input.begin(), input.end(), kIac);
  if (!binary_) {
    const auto cr = std::find(input.begin(), end, kCr);
    if (cr != end) end = cr + 1;
  }
  const auto count = static_cast<std::size_t>(end - input.begin());
  const View data = input.first(count);
  after_cr_ = data.back() == kCr;
  input = input.subspan(count);
  return TelnetItem{.bytes = data};
}

std::optional<TelnetItem> TelnetDecoder::On(std::uint8_t byte) {
  switch (state_) {
    case State::data:  // the byte is kIac
      state_ = State::command;
      return std::nullopt;
    case State::command:
      return OnCommand(byte);
    case State::negotiation:
      state_ = State::data;
      return TelnetItem{.what = TelnetItem::What::negotiation, .verb = verb_, .option = byte};
    case State::option:
      option_ = byte;
      inside_.clear();
      too_long_ = false;
      state_ = State::inside;
      return std::nullopt;
    case State::inside:
    case State::inside_command:
      return OnInside(byte);
  }
  return std::nullopt;
}

std::optional<TelnetItem> TelnetDecoder::OnCommand(std::uint8_t byte) {
  state_ = State::data;
  if (byte == kIac) {
    after_cr_ = false;
    return TelnetItem{.bytes = kDataIac};
  }
  if (byte == kBrk) return TelnetItem{.what = TelnetItem::What::break_key};
  if (byte == kSb) state_ = State::option;
  if (byte >= kWill && byte <= kDont) {
    verb_ = byte;
    state_ = State::negotiation;
  }
  return std::nullopt;  // other commands, such as NOP, need no action
}

std::optional<TelnetItem> TelnetDecoder::OnInside(std::uint8_t byte) {
  if (state_ == State::inside && byte == kIac) {
    state_ = State::inside_command;
    return std::nullopt;
  }
  if (state_ == State::inside_command && byte != kIac) {
    // SE ends a subnegotiation; any other command aborts it.
    if (byte != kSe) return OnCommand(byte);
    state_ = State::data;
    if (too_long_) return std::nullopt;
    return TelnetItem{
        .what = TelnetItem::What::subnegotiation, .option = option_, .bytes = inside_};
  }
  state_ = State::inside;
  too_long_ = too_long_ || inside_.size() == kLongest;
  if (!too_long_) inside_.push_back(byte);
  return std::nullopt;
}

Bytes TelnetOptions::Begin() {
  Bytes offers;
  const auto ask = [&offers](States& states, std::uint8_t verb, std::uint8_t option) {
    states[option] = State::asked;
    Append(offers, View(Bytes{kIac, verb, option}));
  };
  for (const std::uint8_t option : {kBinary, kSuppressGoAhead, kEcho}) ask(ours_, kWill, option);
  for (const std::uint8_t option : {kBinary, kSuppressGoAhead, kComPort}) {
    ask(theirs_, kDo, option);
  }
  return offers;
}

Bytes TelnetOptions::On(std::uint8_t verb, std::uint8_t option) {
  if (verb == kDo || verb == kDont) {
    return Answer(ours_, refused_ours_, option, verb == kDo, kWill, kWont);
  }
  return Answer(theirs_, refused_theirs_, option, verb == kWill, kDo, kDont);
}

Bytes TelnetOptions::Answer(States& states, std::bitset<256>& refused, std::uint8_t option, bool on,
                            std::uint8_t yes, std::uint8_t no) {
  const auto known = states.find(option);
  if (known == states.end()) {
    if (!on || refused.test(option)) return {};
    refused.set(option);
    return {kIac, no, option};
  }
  const State before = known->second;
  known->second = on ? State::yes : State::no;
  // An answer to our own request, or a state that is set already, needs no answer.
  if (before == State::asked || before == known->second) return {};
  return {kIac, on ? yes : no, option};
}

bool TelnetOptions::theirs(std::uint8_t option) const {
  const auto known = theirs_.find(option);
  return known != theirs_.end() && known->second == State::yes;
}

void AppendEscaped(Bytes& out, View data) {
  while (!data.empty()) {
    const auto iac = std::find(data.begin(), data.end(), kIac);
    const auto plain = static_cast<std::size_t>(iac - data.begin());
    Append(out, data.first(plain));
    if (iac == data.end()) return;
    Append(out, View(Bytes{kIac, kIac}));
    data = data.subspan(plain + 1);
  }
}

Bytes Subnegotiation(std::uint8_t option, View bytes) {
  Bytes out = {kIac, kSb, option};
  AppendEscaped(out, bytes);
  Append(out, View(Bytes{kIac, kSe}));
  return out;
}

std::optional<TelnetStream::Part> TelnetStream::Next(View& input, Bytes& answers) {
  while (const auto item = decoder_.Next(input)) {
    switch (item->what) {
      case TelnetItem::What::data:
        return Part{.bytes = item->bytes};
      case TelnetItem::What::negotiation:
        Append(answers, options_.On(item->verb, item->option));
        // A client that agrees to one of these options sends bytes, not lines of text.
        if (options_.theirs(telnet::kBinary) || options_.theirs(telnet::kComPort)) {
          decoder_.SetBinary();
        }
        break;
      case TelnetItem::What::subnegotiation:
        if (item->option == telnet::kComPort) return Part{Part::Kind::command, item->bytes};
        break;
      case TelnetItem::What::break_key:
        return Part{.kind = Part::Kind::break_key};
    }
  }
  return std::nullopt;
}

}  // namespace baudgate::serial_server
