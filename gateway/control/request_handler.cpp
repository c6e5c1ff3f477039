// SPDX-License-Identifier: Apache-2.0
#include "gateway/control/request_handler.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/control/commands.h"
#include "gateway/control/request_shape.h"

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
    : gateway_{&config, store, control, sink, std::move(info), {config, store, sink}} {}

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
  if (command->reads_disk && reader_) return reader_->Ask(*command, json, client, now, later);
  return command->answer(
      gateway_, {json, client, now, [later](const Json& answer) { later(OneLine(answer)); }});
}

void RequestHandler::Apply(const config::Config& config, const history::HistorySource* history) {
  gateway_.config = &config;
  gateway_.info.history = history;
  gateway_.points.Apply(config);
  if (reader_) reader_->Apply(config, history);
}

void RequestHandler::ReadApart() { reader_ = std::make_unique<RecordReader>(gateway_); }

}  // namespace baudgate::control
