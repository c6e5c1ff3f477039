// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/modbus_output.h"

#include <pthread.h>

#include <asio/executor_work_guard.hpp>
#include <asio/post.hpp>
#include <utility>

#include "gateway/daemon/run_on.h"

namespace baudgate {
ModbusOutput::ModbusOutput(const config::Config& config, Links links)
    : server_(config, links.store, links.commands, std::move(links.figures), links.limits,
              links.links) {}

Result<std::unique_ptr<ModbusOutput>> ModbusOutput::Start(const config::Config& config,
                                                          Links links) {
  std::unique_ptr<ModbusOutput> output(new ModbusOutput(config, std::move(links)));
  if (const Status status = output->server_.Listen(output->io_); !status) {
    return Error{status.error()};
  }
  output->thread_ = std::thread([raw = output.get()] {
    pthread_setname_np(pthread_self(), "modbus");
    const auto work = asio::make_work_guard(raw->io_);
    raw->io_.run();
  });
  return output;
}

void ModbusOutput::Apply(const config::Config& config, std::vector<RouteTarget*> lines) {
  RunOn(io_, [&] { server_.Apply(config, lines); });
}

ModbusOutput::~ModbusOutput() { Stop(); }

void ModbusOutput::Stop() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    server_.Stop();
    io_.stop();
  });
  thread_.join();
}

}  // namespace baudgate
