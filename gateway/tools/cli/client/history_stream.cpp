// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/history_stream.h"

#include <thread>

#include "gateway/tools/cli/client/record_pages.h"

namespace baudgate {
namespace {

constexpr Duration kLookForHistory = 200ms;
constexpr int kLooks = 50;

}  // namespace

HistoryStream::HistoryStream(ControlClient& client, const HistoryOptions& options,
                             const std::string& point, std::ostream& err)
    : client_(client), request_({{"command", "history"}, {"point", point}}), err_(err) {
  if (options.since) request_["since_ms"] = options.since->time_since_epoch() / 1ms;
  if (options.until) request_["until_ms"] = options.until->time_since_epoch() / 1ms;
  if (options.every) request_["every_ms"] = *options.every / 1ms;
}

int HistoryStream::Next(const Json*& record) {
  record = nullptr;
  while (at_ >= page_.size()) {
    if (done_) return 0;
    if (const int code = Fetch(); code != 0) return code;
  }
  record = &page_[at_];
  return 0;
}

int HistoryStream::Fetch() {
  Json answer;
  for (int look = 0; look < kLooks; ++look) {
    if (const int code = ReadAnswer(client_, request_, answer, err_); code != 0) return code;
    const auto history = answer.find("history");
    if (history == answer.end() || FieldText(*history, "state") != "opening") break;
    std::this_thread::sleep_for(kLookForHistory);  // it has only just started
  }
  page_ = answer.value("records", Json::array());
  for (const Json& text : answer.value("unread", Json::array())) unread_.push_back(text);
  at_ = 0;
  done_ = !answer.value("more", false);
  request_["after"] = answer.value("next", Json::array());
  return 0;
}

}  // namespace baudgate
