// Who may come in: by address, method and login; and the login itself, its session and its end.
// Any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/web/logins.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::web {

class Access {
 public:
  static constexpr std::string_view kAcknowledge = "/api/v1/alarms/ack";

  /// `events` outlives it; null: none are kept. `version`: of the gateway.
  Access(std::uint16_t port, std::string version, const events::EventSource* events)
      : version_(std::move(version)), events_(events), logins_(port) {}

  /// `token` empty: no login.
  void Set(const config::Config& config, std::optional<std::string> token);
  void SetHistory(bool kept);

  /// Why the request is not let in; empty: it is.
  std::optional<Response> Refuse(const Request& request, Instant now);
  /// Login, its session and its end; empty: the request is for something else.
  std::optional<Response> Answer(const Request& request, Instant now);

 private:
  std::shared_ptr<const config::Web> web() const;
  std::optional<Response> NeedsLogin(const Request& request, Instant now);
  Response Session(const Request& request, Instant now);
  Response Login(const Request& request, Instant now);
  Response Logout(const Request& request);
  std::optional<Response> MayNotAcknowledge(const Request& request) const;

  const std::string version_;
  const events::EventSource* const events_;
  Logins logins_;
  mutable Mutex mutex_;
  std::shared_ptr<const config::Web> web_ BAUDGATE_GUARDED_BY(mutex_);
  std::string gateway_ BAUDGATE_GUARDED_BY(mutex_);
  bool history_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate::web
