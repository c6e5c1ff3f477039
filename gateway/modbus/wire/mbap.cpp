// Cuts a client's byte stream into Modbus TCP frames, and says when it is none.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/wire/mbap.h"

#include <algorithm>

namespace baudgate::modbus {
namespace {

constexpr std::size_t kShortest = 2;  // unit and function
constexpr std::size_t kLongest = kMaxAdu - kMbapPrefix;

}  // namespace

Bytes AduOf(std::uint16_t transaction, std::uint8_t unit, View pdu) {
  const std::size_t length = pdu.size() + 1;
  Bytes frame(kMbapHeader + pdu.size());
  frame[0] = static_cast<std::uint8_t>(transaction >> 8);
  frame[1] = static_cast<std::uint8_t>(transaction);
  frame[4] = static_cast<std::uint8_t>(length >> 8);
  frame[5] = static_cast<std::uint8_t>(length);
  frame[6] = unit;
  std::ranges::copy(pdu, frame.begin() + kMbapHeader);
  return frame;
}

std::span<std::uint8_t> MbapAssembler::Space() {
  if (begin_ > 0) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span(buffer_).subspan(end_);
}

void MbapAssembler::Commit(std::size_t count) { end_ += std::min(count, kCapacity - end_); }

std::string_view MbapAssembler::Defect() const {
  const ByteReader held(Held());
  if (held.U16Be(2).value_or(0) != 0) return "protocol id is not 0";
  const std::size_t length = held.U16Be(4).value_or(kShortest);
  if (length < kShortest) return "length is too small for a function code";
  if (length > kLongest) return "length is above 254";
  return {};
}

MbapAssembler::State MbapAssembler::Peek() const {
  if (!Defect().empty()) return State::malformed;
  const auto length = ByteReader(Held()).U16Be(4);
  if (!length || Held().size() < kMbapPrefix + *length) return State::need_more;
  return State::frame;
}

MbapAssembler::State MbapAssembler::Take(View& frame) {
  const State state = Peek();
  if (state == State::frame) {
    frame = Held().first(kMbapPrefix + *ByteReader(Held()).U16Be(4));
    begin_ += frame.size();
  }
  return state;
}

}  // namespace baudgate::modbus
