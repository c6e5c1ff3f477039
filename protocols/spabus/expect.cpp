// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/expect.h"

#include <algorithm>
#include <string>

#include "protocols/spabus/codec.h"
#include "protocols/spabus/reply.h"
#include "protocols/spabus/settings.h"

namespace baudgate::protocols::spabus {
namespace {

/// Bytes of the longest reply to a read: items of text have up to 131 characters, and a slave
/// decides by itself how long a list is.
std::size_t LongestReply(const Command& command) {
  constexpr std::size_t kItem = 132;
  const std::size_t one_line = kLongestLine + 3;
  if (command.write) return one_line;
  if (std::string_view("LBAM").find(command.category) != std::string_view::npos) return kMaxReply;
  const std::size_t items = std::min<std::size_t>(command.ItemCount(), kMaxReply / kItem);
  return std::clamp(items * kItem + items / 2 * 3 + 16, one_line, kMaxReply);
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  Expectation expect;
  expect.checksum = ChecksumBits(settings);
  if (request.empty()) {
    expect.max_bytes = kMaxLine + 1;
    return expect;
  }
  const ReceivedRequest received = ParseRequest(request);
  if (!received.command) {
    expect.max_bytes = kMaxReply;
    expect.repeatable = false;
    return expect;
  }
  const Command& command = *received.command;
  if (command.slave == kBroadcast) expect.reply = Expectation::Reply::none;
  expect.address = ToBytes(std::to_string(command.slave));
  expect.max_bytes = LongestReply(command);
  const std::size_t head = expect.address.size();
  // `<`, slave, type, colons, checksum, CR and LF around the content.
  expect.shapes.push_back({'N', head + 7, kLongestLine + 2});
  if (command.write) {
    expect.shapes.push_back({'A', head + 6, head + 7});
  } else {
    expect.shapes.push_back({'D', head + 7, expect.max_bytes});
  }
  // Reading L takes the events out of the device; a write may have been carried out unheard.
  expect.repeatable = !command.write && command.category != 'L';
  if (command.write && command.category == 'V' && command.numbers &&
      command.numbers->first <= kPasswordItems.last &&
      command.numbers->last >= kPasswordItems.first) {
    expect.secrets.emplace_back(received.data_at, command.data.size());
    expect.secrets.emplace_back(received.data_at + command.data.size() + 1, 2);  // the checksum
  }
  return expect;
}

}  // namespace baudgate::protocols::spabus
