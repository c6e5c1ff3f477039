// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/expect.h"

#include "gateway/base/text.h"
#include "protocols/dcon/broadcasts.h"
#include "protocols/dcon/channel_types.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/decode.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {
namespace {

/// Forms of the good reply, and of the refusal that every command may get.
std::vector<Shape> Shapes(const Command& command, bool checksum) {
  const std::size_t extra = checksum ? 4 : 2;  // lead, CR, checksum
  const auto form = DefaultForm(command.text);
  std::vector<Shape> shapes = {{'?', extra, extra + 2}};
  if (command.text == kAskSample) {
    shapes.push_back({'>', extra + 3, kMaxFrame});
    shapes.push_back({'!', extra, kMaxFrame});
    return shapes;
  }
  if (!form) {
    shapes.push_back({'>', extra, extra + 2});
    shapes.push_back({'!', extra, kMaxFrame});
    return shapes;
  }
  const bool several = command.text.starts_with("#") || command.text.starts_with("^") ||
                       command.text == "$A";  // the gate of a counter
  const bool data = *form == Form::numbers || *form == Form::number || *form == Form::words ||
                    *form == Form::bits;
  if (data) shapes.push_back({'>', extra + 4, kMaxFrame});
  if (!data || several) shapes.push_back({'!', extra + 2, kMaxFrame});
  return shapes;
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  expect.max_bytes = kMaxFrame;
  expect.checksum = settings.checksum ? kChecksum : kNoChecksum;
  if (request.empty()) return expect;
  const auto command = ParseRequest(request, settings.checksum);
  if (!command) {
    expect.repeatable = false;
    return expect;
  }
  if (command->broadcast) {
    expect.reply = Expectation::Reply::none;
    expect.repeatable = false;
    return expect;
  }
  expect.checksum = ReplyVariant(command->text, settings);
  expect.repeatable = IsRepeatable(command->text);
  expect.shapes = Shapes(*command, settings.checksum);
  const auto form = DefaultForm(command->text);
  // With INIT* grounded a module answers at 00 and tells its stored address in its place.
  const bool init = command->text == "$2" && command->address == 0;
  const bool asked = InputOfQuestion(command->text) || command->text == "$5";
  if (!init && (asked || form == Form::text || form == Form::readback || form == Form::hex)) {
    Append(expect.address, HexByte(ReplyAddress(*command)));
  }
  return expect;
}

}  // namespace baudgate::protocols::dcon
