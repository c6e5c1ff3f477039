// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/reload.h"

#include "gateway/tools/cli/client/control_client.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

int Tell(const Json& answer, std::ostream& out, std::ostream& err) {
  const bool ok = answer.value("ok", false);
  for (const Json& warning : answer.value("warnings", Json::array())) {
    err << warning.get<std::string>() << '\n';
  }
  for (const Json& change : answer.value("changes", Json::array())) {
    out << change.get<std::string>() << '\n';
  }
  const std::string text = answer.value("text", "");
  if (ok) {
    out << text << '\n';
  } else {
    err << text << '\n';
  }
  return ok ? 0 : answer.value("exit", 2);
}

}  // namespace

int RunReload(const ReloadCommand& options, std::ostream& out, std::ostream& err) {
  Json request = {{"command", "reload"}, {"dry_run", options.dry_run}};
  if (options.confirm) request["confirm_ms"] = *options.confirm / 1ms;
  Json answer;
  if (const int code = Ask(options.socket, request, answer, err); code != 0) return code;
  if (options.json) {
    out << answer.dump() << '\n';
    return answer.value("ok", false) ? 0 : answer.value("exit", 2);
  }
  const int code = Tell(answer, out, err);
  const std::chrono::milliseconds left(answer.value("confirm_ms", std::int64_t{0}));
  if (left > 0ms) {
    out << "the gateway goes back in " << FormatDuration(left)
        << ", or when devices stop answering, unless you run: baudgate confirm\n";
  }
  return code;
}

int RunConfirm(const ConfirmCommand& options, std::ostream& out, std::ostream& err) {
  Json answer;
  if (const int code = Ask(options.socket, {{"command", "confirm"}}, answer, err); code != 0) {
    return code;
  }
  return Tell(answer, out, err);
}

}  // namespace baudgate
