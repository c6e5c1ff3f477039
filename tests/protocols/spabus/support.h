// Helpers for tests of SPA Bus: points by their item, requests and replies as text.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/spabus/protocol.h"
#include "protocols/spabus/rules.h"
#include "tests/support/talk.h"

namespace baudgate::protocols::spabus {

using config::Access;
using config::Group;
using config::Type;
using Texts = std::vector<std::string>;

inline config::Point MakePoint(const std::string& read, Type type = Type::float32,
                               Group group = Group::fast, Access access = Access::read) {
  config::Point point = baudgate::ReadPoint("p_" + read, read, type, group);
  point.access = access;
  return point;
}

inline config::Device MakeDevice(std::vector<config::Point> points,
                                 const std::string& address = "1") {
  return DeviceOf(SpabusProtocol(), address, std::move(points));
}

inline std::vector<Bytes> Cut(FrameRule rule, const Expectation& expect, View stream) {
  Assembler assembler;
  assembler.Begin(rule, expect);
  assembler.Feed(stream);
  std::vector<Bytes> frames;
  while (auto frame = assembler.Next(true)) frames.push_back(std::move(*frame));
  return frames;
}

/// Returns a reply: `covered` with its checksum and line end. Example of `covered`: "<1D:0.52:".
inline Bytes ReplyText(const std::string& covered) {
  Bytes frame = ToBytes(covered);
  const std::string checksum = HexByte(Xor8(frame));
  Append(frame, checksum + "\r\n");
  return frame;
}
/// Returns `covered` with the given two characters as checksum, and CR LF.
inline Bytes Sealed(const std::string& covered, const std::string& checksum) {
  return ToBytes(covered + checksum + "\r\n");
}

inline std::string Asked(Talk& talk, const Task& task) {
  const auto request = talk.Ask(task);
  if (!request) return "error: " + request.error();
  return std::string(AsText(View(request->bytes).first(request->bytes.size() - 1)));
}
inline std::vector<std::string> AllRequests(Talk& talk) {
  std::vector<std::string> requests;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const std::string asked = Asked(talk, Poll(query));
    requests.push_back(asked.substr(0, asked.rfind(':') + 1));
  }
  return requests;
}
inline Answer Hear(Talk& talk, const Task& task, const std::string& covered) {
  return talk.Reply(task, ReplyText(covered));
}

/// Returns the text without its check value. Example: ">1WV150:1" for ">1WV150:1:7A".
inline std::string Body(const std::string& request) {
  return request.substr(0, request.rfind(':'));
}

}  // namespace baudgate::protocols::spabus
