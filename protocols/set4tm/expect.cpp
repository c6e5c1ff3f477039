// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/expect.h"

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/frame_rule.h"
#include "protocols/set4tm/settings.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Both forms: a meter that is asked by its short address may answer with the extended one.
void Allow(Expectation& expect, std::size_t tail, std::size_t least, std::size_t most) {
  expect.shapes.push_back({kShortForm, 1 + least + tail, 1 + most + tail});
  expect.shapes.push_back({kExtendedForm, 5 + least + tail, 5 + most + tail});
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  const Checksum checksum = settings.checksum;
  const std::size_t tail = SizeOf(checksum);
  Expectation expect;
  expect.checksum = static_cast<int>(checksum);
  expect.max_bytes = 5 + kMaxData + tail;
  const auto parts = SplitFrame(request, checksum);
  if (!parts) return expect;
  expect.address.assign(parts->address.begin(), parts->address.end());
  const View pdu = parts->body;
  expect.repeatable = pdu[0] != kWrite && pdu[0] != kWriteMemory;
  expect.mirrors = pdu[0] == kLinkTest;
  if (pdu[0] == kOpenChannel && pdu.size() == 1 + kPasswordSize) {
    expect.secrets = {{parts->address.size() + 1, kPasswordSize + tail}};
  }
  if (expect.address[0] == kBroadcast) {
    expect.reply = Expectation::Reply::none;
    return expect;
  }
  Allow(expect, tail, 1, 1);
  if (AnsweredByStatus(pdu)) return expect;
  const auto data = LengthOfData(pdu);
  // SET-4TM.03 may put two bytes after the id (reference, chapter 11).
  const std::size_t more = pdu[0] == kMemoryTagged ? 2 : 0;
  Allow(expect, tail, data.value_or(2), data ? *data + more : kMaxData);
  return expect;
}

}  // namespace baudgate::protocols::set4tm
