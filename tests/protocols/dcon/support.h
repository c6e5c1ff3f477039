// Builds DCON modules, requests and replies for tests.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "protocols/assembler.h"
#include "protocols/dcon/codec.h"
#include "protocols/dcon/conversation.h"
#include "protocols/dcon/protocol.h"
#include "protocols/dcon/rules.h"
#include "protocols/dcon/twin.h"
#include "tests/support/talk.h"

namespace baudgate::protocols::dcon {

inline config::Options MakeOptions(const Settable& given = {}) {
  return OptionsOf(DconProtocol(), given);
}

inline config::Point ReadPoint(const std::string& name, const std::string& read,
                               config::Type type = config::Type::float32,
                               config::Group group = config::Group::fast) {
  return baudgate::ReadPoint(name, read, type, group);
}

inline config::Point WritePoint(const std::string& name, const std::string& read,
                                const std::string& write,
                                config::Type type = config::Type::float32) {
  return baudgate::WritePoint(name, read, write, type);
}

inline config::Device MakeDevice(std::vector<config::Point> points, const Settable& options = {},
                                 const std::string& address = "1") {
  Settable all = {{"identify", false}};
  all.insert(all.end(), options.begin(), options.end());
  return DeviceOf(DconProtocol(), address, std::move(points), all);
}

inline config::Device EightInputs(const Settable& options = {}) {
  std::vector<config::Point> points;
  for (int i = 0; i < 8; ++i) {
    points.push_back(ReadPoint("input_" + std::to_string(i), "#[" + std::to_string(i) + "]"));
  }
  Settable all = {{"checksum", true}, {"channels", std::int64_t{8}}};
  all.insert(all.end(), options.begin(), options.end());
  return MakeDevice(std::move(points), all);
}

inline std::string Asked(Talk& talk, const Task& task) {
  const auto request = talk.Ask(task);
  return request ? std::string(AsText(request->bytes)) : "error: " + request.error();
}
inline Answer Exchange(Talk& talk, const Task& task, std::string_view wire) {
  return talk.Exchange(task, ToBytes(wire));
}

}  // namespace baudgate::protocols::dcon
