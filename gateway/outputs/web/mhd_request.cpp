// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/mhd_request.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <map>

#include "gateway/base/spelling.h"

namespace baudgate::web {
namespace {

/// "10.0.0.7", also of an IPv4 address in its IPv6 form.
std::string AddressText(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address != nullptr && address->sa_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(address)->sin_addr, text.data(),
                text.size());
  } else if (address != nullptr && address->sa_family == AF_INET6) {
    const auto& six = reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(&six)) {
      ::inet_ntop(AF_INET, &six.s6_addr[12], text.data(), text.size());
    } else {
      ::inet_ntop(AF_INET6, &six, text.data(), text.size());
    }
  }
  return text.data();
}

std::string LocalAddress(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  return AddressText(reinterpret_cast<const sockaddr*>(&address));
}

MHD_Result AddHeader(void* to, MHD_ValueKind, const char* key, const char* value) {
  auto& headers = *static_cast<std::map<std::string, std::string>*>(to);
  const auto [found, is_new] = headers.emplace(config::Lower(key), value == nullptr ? "" : value);
  // Two of a kind that may stand once only: neither is believed.
  if (!is_new) found->second += std::string(", ") + (value == nullptr ? "" : value);
  return MHD_YES;
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const int letter = (c | 0x20) - 'a';
  return letter >= 0 && letter < 6 ? letter + 10 : -1;
}

MHD_Result AddQuery(void* to, MHD_ValueKind, const char* key, const char* value) {
  auto& query = *static_cast<std::map<std::string, std::string>*>(to);
  query.emplace(key, value == nullptr ? "" : value);
  return MHD_YES;
}

}  // namespace

int SocketOf(MHD_Connection* connection) {
  const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  return info == nullptr ? -1 : info->connect_fd;
}

std::string PeerOf(MHD_Connection* connection) {
  const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
  return info == nullptr ? std::string() : AddressText(info->client_addr);
}

std::size_t Unescape(void*, MHD_Connection*, char* text) {
  char* to = text;
  for (const char* from = text; *from != '\0'; ++from) {
    const int high = *from == '%' ? HexDigit(from[1]) : -1;
    const int low = high >= 0 ? HexDigit(from[2]) : -1;
    if (low < 0 || high + low == 0) {
      *to++ = *from;
      continue;
    }
    *to++ = static_cast<char>(high * 16 + low);
    from += 2;
  }
  *to = '\0';
  return static_cast<std::size_t>(to - text);
}

Request RequestOf(MHD_Connection* connection, const char* url, const char* method) {
  Request request;
  request.method = std::strcmp(method, "HEAD") == 0 ? "GET" : method;
  request.path = url;
  request.peer = PeerOf(connection);
  request.local = LocalAddress(SocketOf(connection));
  MHD_get_connection_values(connection, MHD_HEADER_KIND, AddHeader, &request.headers);
  MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, AddQuery, &request.query);
  return request;
}

}  // namespace baudgate::web
