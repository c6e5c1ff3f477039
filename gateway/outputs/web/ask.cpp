// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/ask.h"

#include <algorithm>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::web {
namespace {

using control::Json;

constexpr std::string_view kError = "{\"error\":\"";

int StatusOf(const std::string& kind) {
  if (kind == "usage") return 400;
  if (kind == "unknown") return 404;
  return 503;
}

}  // namespace

Result<Json> AskOf(const Request& request, std::string_view command,
                   std::initializer_list<Part> parts) {
  Json ask = {{"command", command}};
  std::vector<std::string_view> names;
  for (const Part& part : parts) names.emplace_back(part.query);
  for (const auto& [name, value] : request.query) {
    const auto part = std::ranges::find(parts, name, &Part::query);
    if (part == parts.end()) {
      return Error{config::Quoted(name) + " is no parameter of " + request.path + ";" +
                   config::DidYouMean(name, names) +
                   (names.empty() ? " it has none" : " there are: " + config::Join(names))};
    }
    const char* const member = part->member != nullptr ? part->member : part->query;
    if (!part->number) {
      ask[member] = value;
      continue;
    }
    const auto number = ParseInteger<std::int64_t>(value);
    if (!number) return Error{config::Quoted(name) + " is a whole number"};
    ask[member] = *number;
  }
  return ask;
}

Response JsonResponse(const Json& json) {
  return TextResponse(200, kJson, json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

Response ResponseOf(std::string answer) {
  if (!answer.starts_with(kError)) return TextResponse(200, kJson, std::move(answer));
  const Json json = Json::parse(answer, nullptr, false);
  return Problem(StatusOf(json.value("error", "")), json.value("message", ""));
}

}  // namespace baudgate::web
