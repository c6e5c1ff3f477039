// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/request.h"

#include <nlohmann/json.hpp>

namespace baudgate::web {

std::string_view Title(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 409:
      return "Conflict";
    case 411:
      return "Length Required";
    case 413:
      return "Content Too Large";
    case 421:
      return "Misdirected Request";
    case 429:
      return "Too Many Requests";
    case 503:
      return "Service Unavailable";
    default:
      return "Error";
  }
}

Response TextResponse(int status, std::string_view type, std::string text) {
  const auto held = std::make_shared<const std::string>(std::move(text));
  Response response;
  response.status = status;
  response.type = type;
  response.body = *held;
  response.owner = held;
  return response;
}

Response Problem(int status, std::string_view detail) {
  using Json = nlohmann::ordered_json;
  const Json json = {
      {"type", "about:blank"}, {"title", Title(status)}, {"status", status}, {"detail", detail}};
  return TextResponse(status, "application/problem+json",
                      json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace baudgate::web
