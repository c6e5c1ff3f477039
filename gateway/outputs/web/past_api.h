// What is answered from the disk: events and history. On a thread of its own, so that a disk that
// is slow does not hold up viewers of the present.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>

#include "gateway/outputs/control/request_handler.h"
#include "gateway/outputs/web/ask.h"
#include "gateway/outputs/web/request.h"

namespace baudgate::web {

class PastApi {
 public:
  /// All of it outlives this; but for Apply everything is called on the thread of `io`.
  PastApi(const config::Config& config, const PointStore& store, LineControl& lines,
          control::GatewayInfo info, asio::io_context& io);

  /// False: this is none of its requests.
  bool Answer(const Request& request, Now now, const Answered& answered);
  static bool Has(std::string_view path);
  /// A reload, from any thread. A page that is being read goes on with what it has.
  void Apply(std::shared_ptr<const config::Config> config,
             std::shared_ptr<const history::HistorySource> history) {
    handler_.Apply(std::move(config), std::move(history));
  }

 private:
  class Download;

  Response Events(const Request& request, Now now);
  Response History(const Request& request, Now now);
  Response HistoryCsv(const Request& request, Now now);
  /// One page of the control socket's `history`.
  std::string Page(const control::Json& ask, Now now);

  asio::io_context& io_;
  NoWrites no_writes_;
  control::RequestHandler handler_;
  std::shared_ptr<PastApi*> alive_ = std::make_shared<PastApi*>(this);  // for downloads
};

}  // namespace baudgate::web
