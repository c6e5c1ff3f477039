// An HTTP client that sends any bytes and reads the answer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tests/support/raw_client.h"

namespace baudgate::web {

struct Reply {
  int status = 0;  ///< 0: the connection was closed before the whole answer
  std::map<std::string, std::string> headers{};  ///< names in lower case
  std::string body{};
};

class HttpClient {
 public:
  explicit HttpClient(std::uint16_t port, int receive_buffer = 0)
      : port_(port), raw_(port, receive_buffer) {}

  Reply Get(const std::string& path, const std::string& more = "");
  Reply Post(const std::string& path, const std::string& body, const std::string& more = "");
  Reply Send(const std::string& bytes);
  Reply Receive();
  /// Returns the next event of a stream. Open must be called first.
  std::optional<std::string> NextEvent();
  /// Sends a GET and reads only the head of the answer.
  Reply Open(const std::string& path, const std::string& more = "");
  std::string Host() const { return "Host: 127.0.0.1:" + std::to_string(port_) + "\r\n"; }
  RawClient& raw() { return raw_; }

 private:
  Reply Head();
  std::string Exactly(std::size_t count);
  std::optional<std::string> Chunk();

  const std::uint16_t port_;
  RawClient raw_;
  std::string events_;
};

}  // namespace baudgate::web
