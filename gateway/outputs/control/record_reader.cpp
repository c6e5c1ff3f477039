// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/record_reader.h"

#include <utility>

namespace baudgate::control {
namespace {

constexpr std::string_view kLate =
    "the disk of the records does not answer in time; look at the disk (dmesg)";

}  // namespace

RecordReader::RecordReader() : worker_("records", [this](bool last) { return Round(last); }) {
  worker_.Start();
}

Reply RecordReader::Ask(const Command& command, std::shared_ptr<const Gateway> gateway,
                        Json request, Writer client, Now now,
                        std::function<void(std::string text)> later) {
  if (!queue_.Put({&command, std::move(gateway), std::move(request), std::move(client), now,
                   std::move(later)})) {
    return Refused(kUnavailable, kLate);
  }
  worker_.Wake();
  return {.text = {}, .late = ErrorLine(kUnavailable, kLate)};
}

Instant RecordReader::Round(bool last) {
  if (last) return kWhenWoken;
  const auto job = queue_.Take();
  if (!job) return kWhenWoken;
  Reply reply = job->command->answer(*job->gateway, {job->request, job->client, job->now, {}});
  job->later(std::move(reply.text));
  return {};
}

}  // namespace baudgate::control
