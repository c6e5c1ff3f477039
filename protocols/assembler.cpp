// SPDX-License-Identifier: Apache-2.0
#include "protocols/assembler.h"

#include <algorithm>

namespace baudgate::protocols {
namespace {

int Severity(Outcome blame) {
  if (blame == Outcome::corrupt) return 3;
  if (blame == Outcome::unexpected) return 2;
  return blame == Outcome::partial ? 1 : 0;
}

}  // namespace

void Assembler::Begin(FrameRule rule, Expectation expect) {
  counters_.discarded += held();
  held_.clear();
  head_ = 0;
  fed_ = 0;
  rule_ = rule;
  expect_ = std::move(expect);
  blame_ = Outcome::none;
  why_ = {};
}

void Assembler::Feed(View bytes) {
  counters_.in += bytes.size();
  fed_ += bytes.size();
  Append(held_, bytes);
}

std::optional<Bytes> Assembler::Next(bool idle, Bytes* discarded) {
  const auto discard = [&](std::size_t size, Outcome blame, std::string_view why) {
    if (discarded != nullptr) Append(*discarded, Held().first(size));
    Discard(size, blame, why);
  };
  while (held() > 0) {
    const Cut cut = rule_(Held(), expect_, idle);
    const std::size_t size = std::clamp<std::size_t>(cut.size, 1, held());
    switch (cut.kind) {
      case Cut::Kind::frame: {
        const View frame = Held().first(size);
        Bytes whole(frame.begin(), frame.end());
        counters_.delivered += size;
        Consume(size);
        return whole;
      }
      case Cut::Kind::discard:
        discard(size, cut.blame, cut.why);
        break;
      case Cut::Kind::need_more:
        if (held() > expect_.max_bytes) {
          discard(1, Outcome::corrupt, "the bytes are longer than any reply");
        } else if (idle) {
          discard(held(), Outcome::partial, "stopped mid-frame");
        } else {
          return std::nullopt;
        }
        break;
    }
  }
  return std::nullopt;
}

void Assembler::Discard(std::size_t count, Outcome blame, std::string_view why) {
  if (why_.empty() || Severity(blame) > Severity(blame_)) {
    blame_ = blame;
    why_ = why;
  }
  counters_.discarded += count;
  Consume(count);
}

void Assembler::Consume(std::size_t count) {
  head_ += count;
  if (head_ < held_.size() && head_ < 512) return;
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(head_));
  head_ = 0;
}

}  // namespace baudgate::protocols
