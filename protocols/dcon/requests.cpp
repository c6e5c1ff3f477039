// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/requests.h"

#include <algorithm>
#include <array>

#include "protocols/dcon/codec.h"
#include "protocols/dcon/expect.h"

namespace baudgate::protocols::dcon {
namespace {

Request MakeRequest(Bytes bytes, const Settings& settings) {
  Request request;
  request.bytes = std::move(bytes);
  request.expect = Expect(request.bytes, settings);
  return request;
}

}  // namespace

Requests::Requests(std::uint8_t address, const Settings& settings)
    : address_(address), settings_(settings), other_mode_(settings) {
  other_mode_.checksum = !settings.checksum;
}

Request Requests::Own(std::string_view command) const {
  return MakeRequest(BuildRequest(command, address_, settings_.checksum), settings_);
}

Request Requests::Broadcast(std::string_view text) const {
  Request request = MakeRequest(BuildBroadcast(text, settings_.checksum), settings_);
  request.prepares = true;
  return request;
}

/// A module that does not know the question is silent: the next question comes sooner.
Request Requests::Question(const Identification::Question& question) const {
  const Settings& settings = question.other_mode ? other_mode_ : settings_;
  Request request =
      MakeRequest(BuildRequest(question.command, address_, settings.checksum), settings);
  request.expect.repeatable = false;
  request.prepares = true;
  return request;
}

bool Requests::IsInOtherMode(View request) const {
  return settings_.identify &&
         std::ranges::any_of(std::array{kAskName, kAskType}, [&](const char* command) {
           return std::ranges::equal(BuildRequest(command, address_, other_mode_.checksum),
                                     request);
         });
}

}  // namespace baudgate::protocols::dcon
