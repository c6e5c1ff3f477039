// `WebTest`: a gateway with the configuration of tests/gateway/outputs/status/two_lines.h behind a
// web server on a free port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "gateway/outputs/web/web_server.h"
#include "tests/gateway/outputs/control/fixture.h"
#include "tests/gateway/outputs/status/two_lines.h"
#include "tests/gateway/outputs/web/http_client.h"
#include "tests/support/renew_store.h"

namespace baudgate::web {

inline constexpr const char* kToken = "0123456789abcdef";

class WebTest : public ::testing::Test {
 protected:
  WebTest() {
    config_.web.on = true;
    config_.web.listen.port = 0;
    info_.version = "1.2.3";
    info_.started = ReadClocks().instant;
  }
  ~WebTest() override { Stop(); }

  void Start(const std::string& token = "") {
    Renew(store_, config_);
    auto opened = WebServer::Open(config_.web, nullptr);
    ASSERT_TRUE(opened) << opened.error();
    port_ = opened->socket.port();
    if (!token.empty()) opened->token = token;
    LiveApi::Links links{store_, lines_, info_, commands_, reload_};
    links.configuration = [] { return Result<std::string>("lines: []\n"); };
    auto server = WebServer::Start(Running(), std::move(*opened), std::move(links), limits_);
    ASSERT_TRUE(server) << server.error();
    server_ = std::move(*server);
  }
  void Stop() { server_.reset(); }
  std::shared_ptr<const config::Config> Running() const {
    return {std::shared_ptr<void>(), &config_};
  }
  HttpClient Client(int receive_buffer = 0) const { return HttpClient(port_, receive_buffer); }
  Reply Get(const std::string& path, const std::string& more = "") const {
    return Client().Get(path, more);
  }
  void Put(std::uint32_t device, std::uint32_t point, double value) {
    const bus::Sample sample{point, Value(value), Quality::good};
    store_.Update(device, {&sample, 1}, ReadClocks(), 20ms);
  }

  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
  control::FakeLines lines_{store_};
  status::GatewayInfo info_;
  bus::CommandSink* commands_ = nullptr;  // set: values can be written
  control::ReloadService* reload_ = nullptr;
  Limits limits_;
  std::uint16_t port_ = 0;
  std::unique_ptr<WebServer> server_;
};

}  // namespace baudgate::web
