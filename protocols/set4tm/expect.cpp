// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/expect.h"

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/frame_rule.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::size_t kShortRest = 1 + kChecksumSize;
constexpr std::size_t kExtendedRest = 5 + kChecksumSize;

/// Both forms: a meter that is asked by its short address may answer with the extended one.
void Allow(Expectation& expect, std::size_t least, std::size_t most) {
  expect.shapes.push_back({kShortForm, kShortRest + least, kShortRest + most});
  expect.shapes.push_back({kExtendedForm, kExtendedRest + least, kExtendedRest + most});
}

}  // namespace

Expectation Expect(View request, const config::Options&) {
  Expectation expect;
  expect.max_bytes = kExtendedRest + kMaxData;
  const auto parts = SplitFrame(request);
  if (!parts) return expect;
  expect.address.assign(parts->address.begin(), parts->address.end());
  const View pdu = parts->body;
  expect.repeatable = pdu[0] != kWrite && pdu[0] != kWriteMemory;
  expect.mirrors = pdu[0] == kLinkTest;
  if (pdu[0] == kOpenChannel && pdu.size() == 1 + kPasswordSize) {
    expect.secrets = {{parts->address.size() + 1, kPasswordSize + kChecksumSize}};
  }
  if (expect.address[0] == kBroadcast) {
    expect.reply = Expectation::Reply::none;
    return expect;
  }
  Allow(expect, 1, 1);
  if (AnsweredByStatus(pdu)) return expect;
  const auto data = LengthOfData(pdu);
  Allow(expect, data.value_or(2), data.value_or(kMaxData));
  return expect;
}

}  // namespace baudgate::protocols::set4tm
