// SPDX-License-Identifier: Apache-2.0
#include "config/model/outputs.h"

#include "gateway/base/text.h"

namespace baudgate::config {

std::string Listener::Address() const { return is_serial() ? path : HostAndPort(host, port); }

std::uint8_t Route::SlaveOf(std::uint8_t unit) const {
  return remap ? static_cast<std::uint8_t>(*remap + (unit - first)) : unit;
}

std::string Route::Units() const {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

std::string Route::Target() const {
  return line.empty() ? "server " + HostAndPort(host, port) : "line " + line;
}

std::string Web::Address() const { return HostAndPort(listen.host, listen.port); }

std::string MqttBroker::Address() const {
  return std::string(tls ? kMqttsScheme : kMqttScheme) + HostAndPort(at.host, at.port);
}

}  // namespace baudgate::config
