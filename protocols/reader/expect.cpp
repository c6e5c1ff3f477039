// SPDX-License-Identifier: Apache-2.0
#include "protocols/reader/expect.h"

#include "protocols/reader/codec.h"

namespace baudgate::protocols::reader {
namespace {

constexpr int kNone = 0x100;  // no such character
constexpr int kEnds = 0x200;  // more than any
constexpr std::size_t kMostInformation = 256;

int CodeOf(std::optional<std::uint8_t> character) { return character ? *character : kNone; }

std::optional<std::uint8_t> OfCode(int code) {
  if (code >= kNone) return std::nullopt;
  return static_cast<std::uint8_t>(code);
}

}  // namespace

Shape ShapeOf(const Settings& settings) {
  return {CodeOf(settings.start) + kEnds * CodeOf(settings.end), settings.length, settings.most};
}

Settings OfShape(const Shape& shape) {
  return {.form = Form::text,
          .start = OfCode(shape.tag % kEnds),
          .end = OfCode(shape.tag / kEnds),
          .length = shape.min_length,
          .most = shape.max_length};
}

/// A text that is too long is kept a little longer, so that its end is not taken for one of its
/// own.
Expectation Expect(View request, const Settings& settings) {
  if (IsInformation(request)) {
    return {.shapes = {{.tag = kInformation}}, .max_bytes = kMostInformation};
  }
  Expectation expect{.reply = Expectation::Reply::standing, .max_bytes = kTagFrame};
  if (settings.form == Form::text) {
    expect.shapes = {ShapeOf(settings)};
    expect.max_bytes = settings.most + 2 * kMostAround;
  } else if (settings.asks) {
    expect.shapes = {{.tag = kTagsAndAnswers}};
  }
  return expect;
}

}  // namespace baudgate::protocols::reader
