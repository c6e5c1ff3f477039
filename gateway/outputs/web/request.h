// What a browser or a program asks over HTTP, and what it gets: plain values, without a library.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace baudgate::web {

struct Request {
  std::string method{};  ///< "GET", "POST", …; a HEAD is a GET
  std::string path{};    ///< "/api/v1/status", its escapes resolved
  std::map<std::string, std::string> query{};
  std::map<std::string, std::string> headers{};  ///< by names in lower case
  std::string body{};
  std::string peer{};   ///< address of the other side: "10.0.0.7"
  std::string local{};  ///< address of this machine that it has connected to

  /// Empty: it is not there.
  std::optional<std::string> Header(const std::string& name) const { return In(headers, name); }
  std::optional<std::string> Query(const std::string& name) const { return In(query, name); }

 private:
  static std::optional<std::string> In(const std::map<std::string, std::string>& map,
                                       const std::string& name) {
    const auto found = map.find(name);
    return found == map.end() ? std::nullopt : std::optional(found->second);
  }
};

/// An answer without an end. Read on one thread; `wake`, which it is given before the first Read,
/// may be called from any.
class Stream {
 public:
  virtual ~Stream() = default;
  static constexpr std::ptrdiff_t kEnd = -1;
  /// How many bytes it has written; 0: there are none now, and `wake` will be called.
  virtual std::ptrdiff_t Read(std::span<char> into) = 0;
  virtual void SetWake(std::function<void()> wake) = 0;
};

struct Response {
  int status = 200;
  std::string type{};  ///< empty: there is no content
  std::vector<std::pair<std::string, std::string>> headers{};
  std::string_view body{};
  std::shared_ptr<const void> owner{};  ///< of what `body` shows; null: it is there for ever
  std::shared_ptr<Stream> stream{};     ///< in place of a body
};

/// Takes the answer, once, on any thread.
using Answered = std::function<void(Response)>;

inline constexpr std::string_view kJson = "application/json";

Response TextResponse(int status, std::string_view type, std::string text);
/// application/problem+json: {"type":"about:blank","title":"Not Found","status":404,"detail":…}.
Response Problem(int status, std::string_view detail);
std::string_view Title(int status);

}  // namespace baudgate::web
