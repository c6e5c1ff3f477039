// A client of HTTP that sends what a test says, byte by byte, and reads what comes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tests/support/raw_client.h"

namespace baudgate::web {

struct Reply {
  int status = 0;  ///< 0: the other side has closed before it was whole
  std::map<std::string, std::string> headers{};  ///< by names in lower case
  std::string body{};
};

class HttpClient {
 public:
  explicit HttpClient(std::uint16_t port, int receive_buffer = 0)
      : port_(port), raw_(port, receive_buffer) {}

  /// GET with `more` headers, each with its line end.
  Reply Get(const std::string& path, const std::string& more = "");
  Reply Post(const std::string& path, const std::string& body, const std::string& more = "");
  /// The bytes as they are, and the answer.
  Reply Send(const std::string& bytes);
  Reply Receive();
  /// Without the head of the answer; of a stream the next event, "event: beat\ndata: {}".
  std::optional<std::string> NextEvent();
  /// Sends a GET and reads the head of the answer only.
  Reply Open(const std::string& path, const std::string& more = "");
  std::string Host() const { return "Host: 127.0.0.1:" + std::to_string(port_) + "\r\n"; }
  RawClient& raw() { return raw_; }

 private:
  Reply Head();
  std::string Exactly(std::size_t count);
  /// The next piece of a chunked body; nothing: it has ended.
  std::optional<std::string> Chunk();

  const std::uint16_t port_;
  RawClient raw_;
  std::string events_;
};

}  // namespace baudgate::web
