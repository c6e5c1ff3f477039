// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status.h"

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/status_view.h"

namespace baudgate {
namespace {

constexpr int kNotUnderstood = 4;

}  // namespace

std::string OtherVersion(const nlohmann::ordered_json& status) {
  return "baudgate: the gateway is of another version (" +
         status.value("version", std::string("unknown")) +
         "); 'status --json' shows its answer as it is";
}

int RunStatus(const StatusOptions& options, std::ostream& out, std::ostream& err) {
  ControlClient::Json request = {{"command", "status"}};
  if (!options.target.empty()) request["target"] = options.target;
  ControlClient::Json status;
  if (const int code = Ask(options.socket, request, status, err); code != 0) return code;
  if (options.json) {
    out << status.dump(2, ' ', false, ControlClient::Json::error_handler_t::replace) << '\n';
    return 0;
  }
  TableView view = options.terminal.value_or(TableView{});
  view.height = 0;  // printed once, not redrawn: everything is shown
  try {
    out << RenderStatus(status, options.target, view);
  } catch (const ControlClient::Json::exception&) {
    err << OtherVersion(status) << '\n';
    return kNotUnderstood;
  }
  return 0;
}

}  // namespace baudgate
