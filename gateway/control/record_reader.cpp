// SPDX-License-Identifier: Apache-2.0
#include "gateway/control/record_reader.h"

#include <utility>

namespace baudgate::control {
namespace {

constexpr std::string_view kLate =
    "the disk of the records does not answer in time; look at the disk (dmesg)";

}  // namespace

RecordReader::RecordReader(Gateway gateway)
    : gateway_(std::move(gateway)), worker_("records", [this](bool last) { return Round(last); }) {
  worker_.Start();
}

Reply RecordReader::Ask(const Command& command, Json request, Writer client, Now now,
                        std::function<void(std::string text)> later) {
  if (!queue_.Put({&command, std::move(request), std::move(client), now, std::move(later)})) {
    return Refused(kUnavailable, kLate);
  }
  worker_.Wake();
  return {.text = {}, .late = ErrorLine(kUnavailable, kLate)};
}

void RecordReader::Apply(const config::Config& config, const history::HistorySource* history) {
  const MutexLock lock(mutex_);
  gateway_.config = &config;
  gateway_.info.history = history;
}

Instant RecordReader::Round(bool last) {
  if (last) return kWhenWoken;
  const auto job = queue_.Take();
  if (!job) return kWhenWoken;
  Reply reply;
  {
    const MutexLock lock(mutex_);
    reply = job->command->answer(gateway_, {job->request, job->client, job->now, {}});
  }
  job->later(std::move(reply.text));
  return {};
}

}  // namespace baudgate::control
