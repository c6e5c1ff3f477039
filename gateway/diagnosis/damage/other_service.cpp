// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/other_service.h"

#include <algorithm>
#include <string_view>

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr const char* kPortNumber = "check the host and the port number of the line";
constexpr const char* kNoTelnet = "set its port to raw TCP, without Telnet or RFC 2217";

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
    {"ACKF", "an OPC UA server answers"},      {"ERRF", "an OPC UA server answers"},
    {"FINS", "a FINS server answers (Omron)"},
};

/// An alert, or a handshake.
bool IsTls(View heard) {
  return heard.size() >= 5 && (heard[0] == 0x15 || heard[0] == 0x16) && heard[1] == 3 &&
         heard[2] <= 4;
}

/// STARTDT, STOPDT or TESTFR, asked or confirmed; or an acknowledgement.
bool IsIec104(View heard) {
  if (heard.size() < 6 || heard[0] != 0x68 || heard[1] != 4) return false;
  const bool unnumbered = (heard[2] & 3) == 3 && heard[3] == 0 && heard[4] == 0 && heard[5] == 0;
  return unnumbered || (heard[2] == 1 && heard[3] == 0);
}

/// ISO on TCP, with a whole packet that confirms, refuses or carries data.
bool IsIsoOnTcp(View heard) {
  if (heard.size() < 7 || heard[0] != 3 || heard[1] != 0) return false;
  const std::size_t size = heard[2] * 256U + heard[3];
  return size == heard.size() && (heard[5] == 0xD0 || heard[5] == 0xF0 || heard[5] == 0x80);
}

bool IsDnp3(View heard) {
  return heard.size() >= 10 && heard[0] == 0x05 && heard[1] == 0x64 && heard[2] >= 5;
}

struct BinaryService {
  bool (*is_it)(View);
  const char* cause;
};
constexpr BinaryService kBinaryServices[] = {
    {IsTls, "the server wants TLS"},
    {IsIec104, "an IEC 60870-5-104 server answers"},
    {IsIsoOnTcp, "an S7 or IEC 61850 server answers (ISO on TCP)"},
    {IsDnp3, "a DNP3 outstation answers"},
};

}  // namespace

bool IsTelnet(View heard) {
  return heard.size() >= 3 && heard[0] == 0xFF && heard[1] >= 0xFB && heard[1] <= 0xFE &&
         heard[2] < 0x80;
}

std::optional<Finding> OtherService(View heard, bool modbus) {
  const auto other = [&](const char* cause, const char* remedy) {
    return Finding{.symptom = Symptom::other_protocol,
                   .bytes = heard.size(),
                   .cause = cause,
                   .remedy = remedy};
  };
  for (const Service& service : kServices) {
    if (AsText(heard).starts_with(service.begins)) return other(service.cause, kPortNumber);
  }
  for (const BinaryService& service : kBinaryServices) {
    if (service.is_it(heard)) return other(service.cause, kPortNumber);
  }
  if (IsTelnet(heard)) {
    return other("the server speaks Telnet", modbus ? kPortNumber : kNoTelnet);
  }
  return std::nullopt;
}

}  // namespace baudgate
