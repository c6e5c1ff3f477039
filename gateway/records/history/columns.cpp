// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/columns.h"

namespace baudgate::history {

void ColumnWriter::Unsigned(std::uint64_t number) {
  for (; number > 0x7F; number >>= 7U) {
    bytes_.push_back(static_cast<std::uint8_t>((number & 0x7FU) | 0x80U));
  }
  bytes_.push_back(static_cast<std::uint8_t>(number));
}

void ColumnWriter::Text(const std::string& text) {
  Unsigned(text.size());
  Append(bytes_, text);
}

std::uint64_t ColumnReader::Unsigned() {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (!ok_ || rest_.empty()) break;
    const std::uint8_t byte = rest_.front();
    rest_ = rest_.subspan(1);
    number |= std::uint64_t{byte & 0x7FU} << shift;
    if ((byte & 0x80U) == 0) return number;
  }
  ok_ = false;
  return 0;
}

std::string ColumnReader::Text() {
  const std::uint64_t size = Unsigned();
  if (!ok_ || size > rest_.size()) {
    ok_ = false;
    return {};
  }
  const auto text = AsText(rest_.first(size));
  rest_ = rest_.subspan(size);
  return std::string(text);
}

}  // namespace baudgate::history
