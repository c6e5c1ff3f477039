// `Request` and `Response` are an HTTP request and its answer, independent of the HTTP library.
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

#include "gateway/base/result.h"
#include "gateway/base/role.h"

namespace baudgate::web {

struct Request {
  std::string method{};  ///< "GET", "POST", …; a HEAD request has "GET"
  std::string path{};    ///< e.g. "/api/v1/status", without escapes
  std::map<std::string, std::string> query{};
  std::map<std::string, std::string> headers{};  ///< by name in lower case
  std::string body{};
  std::string peer{};  ///< address of the other end of the connection, e.g. "10.0.0.7"
  /// Address of the client that a trusted proxy has named; empty: the peer is the client.
  std::string forwarded_for{};
  bool logged_in = false;  ///< the client has logged in or need not (Access::WhoAsks)
  /// The user who is logged in, and the role; empty: the client has no user.
  std::string user{};
  std::optional<Role> role{};
  bool tls = false;     ///< the connection itself is encrypted
  std::string local{};  ///< address of this machine to which the client has connected

  const std::string& client() const { return forwarded_for.empty() ? peer : forwarded_for; }
  /// Returns the name of the client in records: "web:10.0.0.7", "web:anna@10.0.0.7".
  std::string Origin() const { return "web:" + (user.empty() ? "" : user + "@") + client(); }
  std::optional<std::string> Header(const std::string& name) const { return In(headers, name); }
  std::optional<std::string> Query(const std::string& name) const { return In(query, name); }

 private:
  static std::optional<std::string> In(const std::map<std::string, std::string>& map,
                                       const std::string& name) {
    const auto found = map.find(name);
    return found == map.end() ? std::nullopt : std::optional(found->second);
  }
};

/// An answer that is sent piece by piece. One thread calls Read, after SetWake was called. The wake
/// function may be called on any thread.
class Stream {
 public:
  virtual ~Stream() = default;
  static constexpr std::ptrdiff_t kEnd = -1;
  /// Writes bytes to `into` and returns their number. 0: there are no bytes now, and `wake` will be
  /// called later. kEnd: the stream has ended.
  virtual std::ptrdiff_t Read(std::span<char> into) = 0;
  virtual void SetWake(std::function<void()> wake) = 0;
};

struct Response {
  int status = 200;
  std::string type{};  ///< content type; empty: the answer has no body
  std::vector<std::pair<std::string, std::string>> headers{};
  std::string_view body{};
  /// Keeps the bytes of `body` alive; null: the bytes are constants.
  std::shared_ptr<const void> owner{};
  std::shared_ptr<Stream> stream{};  ///< null: `body` is the answer
};

/// Takes the answer to a request. It is called once, on any thread.
using Answered = std::function<void(Response)>;

inline constexpr std::string_view kJson = "application/json";

Response TextResponse(int status, std::string_view type, std::string text);
/// Returns application/problem+json: {"type":"about:blank","title":"Not
/// Found","status":404,"detail":…}.
Response Problem(int status, std::string_view detail);
std::string_view Title(int status);

}  // namespace baudgate::web
