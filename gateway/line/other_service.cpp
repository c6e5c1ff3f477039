// SPDX-License-Identifier: Apache-2.0
#include "gateway/line/other_service.h"

#include <algorithm>
#include <string_view>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr const char* kPortNumber = "check the host and the port number of the line";

struct Service {
  std::string_view begins;
  const char* cause;
};
constexpr Service kServices[] = {
    {"HTTP/", "a web server answers"},         {"<!DOCTYPE", "a web server answers"},
    {"<html", "a web server answers"},         {"SSH-", "an SSH server answers"},
    {"RTSP/", "a camera answers (RTSP)"},      {"220 ", "a mail or file server answers"},
    {"220-", "a mail or file server answers"}, {"* OK ", "a mail server answers"},
    {"+OK ", "a mail server answers"},         {"-ERR ", "a database or mail server answers"},
    {"AMQP", "a message broker answers"},      {"RFB 0", "a remote desktop answers (VNC)"},
};

/// An alert, or a handshake.
bool IsTls(View heard) {
  return heard.size() >= 5 && (heard[0] == 0x15 || heard[0] == 0x16) && heard[1] == 3 &&
         heard[2] <= 4;
}

/// IAC and WILL, WONT, DO or DONT, at the front.
bool IsTelnet(View heard) {
  return heard.size() >= 3 && heard[0] == 0xFF && heard[1] >= 0xFB && heard[1] <= 0xFE &&
         heard[2] < 0x80;
}

}  // namespace

std::optional<Finding> OtherService(View heard) {
  const auto other = [&](const char* cause, const char* remedy) {
    return Finding{.symptom = Symptom::other_protocol,
                   .bytes = heard.size(),
                   .cause = cause,
                   .remedy = remedy};
  };
  for (const Service& service : kServices) {
    if (AsText(heard).starts_with(service.begins)) return other(service.cause, kPortNumber);
  }
  if (IsTls(heard)) return other("the server wants TLS", kPortNumber);
  if (IsTelnet(heard)) {
    return other("the server speaks Telnet", "set its port to raw TCP, without Telnet or RFC 2217");
  }
  return std::nullopt;
}

}  // namespace baudgate
