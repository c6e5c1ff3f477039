// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/web/http_client.h"

#include "gateway/base/text.h"

namespace baudgate::web {

Reply HttpClient::Get(const std::string& path, const std::string& more) {
  return Send("GET " + path + " HTTP/1.1\r\n" + Host() + more + "\r\n");
}

Reply HttpClient::Post(const std::string& path, const std::string& body, const std::string& more) {
  return Send("POST " + path + " HTTP/1.1\r\n" + Host() +
              "Content-Length: " + std::to_string(body.size()) + "\r\n" + more + "\r\n" + body);
}

Reply HttpClient::Open(const std::string& path, const std::string& more) {
  raw_.Send("GET " + path + " HTTP/1.1\r\n" + Host() + more + "\r\n");
  return Head();
}

Reply HttpClient::Send(const std::string& bytes) {
  raw_.Send(bytes);
  return Receive();
}

Reply HttpClient::Head() {
  Reply reply;
  const auto first = raw_.ReceiveLine();
  if (!first || first->size() < 12) return reply;
  const int status = std::stoi(first->substr(9, 3));
  for (;;) {
    auto line = raw_.ReceiveLine();
    if (!line) return reply;
    if (!line->empty() && line->back() == '\r') line->pop_back();
    if (line->empty()) break;
    const std::size_t colon = line->find(':');
    const std::string name = Lower(line->substr(0, colon));
    std::string value(Trim(std::string_view(*line).substr(colon + 1)));
    reply.headers.emplace(name, std::move(value));
  }
  reply.status = status;
  return reply;
}

std::string HttpClient::Exactly(std::size_t count) {
  const Bytes bytes = raw_.Receive(count);
  return {bytes.begin(), bytes.end()};
}

std::optional<std::string> HttpClient::Chunk() {
  const auto size = raw_.ReceiveLine();
  if (!size || size->empty()) return std::nullopt;
  const std::size_t count = std::stoul(*size, nullptr, 16);
  std::string text = Exactly(count + 2);
  if (count == 0 || text.size() != count + 2) return std::nullopt;
  text.resize(count);
  return text;
}

Reply HttpClient::Receive() {
  Reply reply = Head();
  if (reply.status == 0 || reply.status == 204 || reply.status == 304) return reply;
  if (reply.headers.contains("content-length")) {
    reply.body = Exactly(std::stoul(reply.headers["content-length"]));
    return reply;
  }
  while (auto chunk = Chunk()) reply.body += *chunk;
  return reply;
}

std::optional<std::string> HttpClient::NextEvent() {
  for (;;) {
    const std::size_t end = events_.find("\n\n");
    if (end != std::string::npos) {
      std::string event = events_.substr(0, end);
      events_.erase(0, end + 2);
      return event;
    }
    auto chunk = Chunk();
    if (!chunk) return std::nullopt;
    events_ += *chunk;
  }
}

}  // namespace baudgate::web
