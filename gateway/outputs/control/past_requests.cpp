// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/past_requests.h"

#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

std::optional<events::PastQuery> PastQueryOf(const std::string& text) {
  const auto parts = Split(text, '.');
  if (parts.size() != 4) return std::nullopt;
  return events::PastQuery{.line = std::string(parts[0]),
                           .device = std::string(parts[1]),
                           .name = std::string(parts[2]) + "." + std::string(parts[3])};
}

Json PageJson(const events::PastPage& page, const std::string& point) {
  Json records = Json::array();
  for (const events::PastRow& row : page.rows) {
    Json json = {{"time", FormatWallTime(row.time)}, {"point", point}};
    json["value"] = ValueJson(row.value);
    if (row.quality) {
      json["quality"] = row.quality->word();
      json["quality_text"] = Name(*row.quality);
      json["seconds"] = row.span / 1s;
    } else {
      json["quality"] = nullptr;
      json["gap"] = "overwritten";
      json["until"] = FormatWallTime(row.time + row.span);
    }
    records.push_back(std::move(json));
  }
  return {{"records", std::move(records)},
          {"next", Json::array({page.next.seq, page.next.time})},
          {"more", page.more}};
}

}  // namespace baudgate::control
