// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/writes.h"

#include <fmt/format.h>

#include <vector>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/tools/cli/client/record_pages.h"
#include "gateway/tools/terminal/stream_table.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

std::string ValueText(const Json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return "-";
  if (found->is_string()) return Harmless(found->get<std::string>());
  return found->is_number_float() ? FormatNumber(found->get<double>()) : found->dump();
}

std::string Remark(const Json& record) {
  std::string text;
  const auto count = record.value("count", std::int64_t{1});
  if (count > 1) {
    text = fmt::format("{} times until {}", count, FieldText(record, "last_time"));
    const std::string first = ValueText(record, "first");
    if (first != "-") text += ", the first " + first;
  }
  const std::string reason = FieldText(record, "reason");
  return text.empty() || reason.empty() ? text + reason : text + "; " + reason;
}

StreamTable::Row RowOf(const Json& record) {
  std::string target;
  for (const char* key : {"line", "device", "point"}) {
    const std::string part = FieldText(record, key);
    if (!part.empty()) target += (target.empty() ? "" : ".") + part;
  }
  const std::string change = ValueText(record, "old") + " -> " + ValueText(record, "new");
  return {FieldText(record, "time"),
          FieldText(record, "client"),
          target,
          change,
          FieldText(record, "outcome"),
          Remark(record)};
}

std::vector<StreamTable::Column> WriteColumns() {
  return {{"time", 24},       {"client", 21}, {"point", 36},
          {"old -> new", 20}, {"outcome", 8}, {"reason"}};
}

class WritePrinter {
 public:
  WritePrinter(const WritesOptions& options, std::ostream& out, std::ostream& err)
      : options_(options), out_(out), err_(err), table_(WriteColumns(), options.width) {}

  void Print(const Json& records) {
    std::vector<StreamTable::Row> rows;
    for (const Json& record : records) {
      any_ = true;
      if (options_.json) {
        out_ << record.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
      } else {
        rows.push_back(RowOf(record));
      }
    }
    table_.Print(rows, out_);
  }

  void End() {
    if (any_) return;
    std::ostream& where = options_.json ? err_ : out_;
    where << "nothing has been written" << (options_.since ? " since then" : " yet") << '\n';
  }

 private:
  const WritesOptions& options_;
  std::ostream& out_;
  std::ostream& err_;
  StreamTable table_;
  bool any_ = false;
};

}  // namespace

int RunWrites(const WritesOptions& options, std::ostream& out, std::ostream& err) {
  Json request = {{"command", "writes"}, {"after", 0}};
  if (options.follow) request["order"] = "settled";
  if (options.since) request["since_ms"] = options.since->time_since_epoch() / 1ms;
  WritePrinter printer(options, out, err);
  const int code = ReadPages(
      {request, "audit", options.follow, options.seconds, options.socket},
      [&](const Json& records) { printer.Print(records); }, out, err);
  if (code == 0 && !options.follow) printer.End();
  return code;
}

}  // namespace baudgate
