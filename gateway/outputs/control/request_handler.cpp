// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/request_handler.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/outputs/control/commands.h"
#include "gateway/outputs/control/request_shape.h"

namespace baudgate::control {
namespace {

/// For `baudgate` itself, which asks for the points of a pattern: people have `history`.
constexpr std::string_view kNotListed = "kept_points";

std::string NoCommand(const std::string& name) {
  std::vector<std::string_view> names;
  for (const Command& command : Commands()) {
    if (command.name != kNotListed) names.push_back(command.name);
  }
  return config::Quoted(name) + " is no command;" + config::DidYouMean(name, names) +
         " there are: " + config::Join(names);
}

}  // namespace

RequestHandler::RequestHandler(const config::Config& config, const PointStore& store,
                               LineControl& control, CommandSink& sink, GatewayInfo info)
    : points_(store, sink, [audit = info.audit] { return audit::PastOf(audit); }),
      gateway_(std::make_shared<Gateway>(Gateway{
          {std::shared_ptr<void>(), &config}, store, control, sink, std::move(info), points_})) {}

Reply RequestHandler::Answer(std::string_view request, const Writer& client, Now now,
                             const Later& later) {
  const Json json = Json::parse(request, nullptr, false);
  if (!json.is_object()) {
    return Refused(kUsage,
                   "a request is one JSON object in one line, for example "
                   "{\"command\":\"status\"}");
  }
  const std::string name = TextOf(json, "command");
  const auto command = std::ranges::find(Commands(), name, &Command::name);
  if (command == Commands().end()) return Refused(kUsage, NoCommand(name));
  if (const Status shape = CheckShape(*command, json); !shape) {
    return Refused(kUsage, shape.error());
  }
  const auto present = gateway();
  if (command->reads_disk && reader_) {
    return reader_->Ask(*command, present, json, client, now, later);
  }
  return command->answer(
      *present, {json, client, now, [later](const Json& answer) { later(OneLine(answer)); }});
}

template <typename Change>
void RequestHandler::Renew(Change change) {
  const MutexLock lock(mutex_);
  auto next = std::make_shared<Gateway>(*gateway_);
  change(*next);
  gateway_ = std::move(next);
}

void RequestHandler::SetReload(ReloadService& service) {
  Renew([&](Gateway& next) { next.reload = &service; });
}

void RequestHandler::Apply(std::shared_ptr<const config::Config> config,
                           std::shared_ptr<const history::HistorySource> history) {
  Renew([&](Gateway& next) {
    next.config = std::move(config);
    next.info.history = std::move(history);
  });
}

void RequestHandler::ReadApart() { reader_ = std::make_unique<RecordReader>(); }

}  // namespace baudgate::control
