// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/scan/line_loan.h"

#include <sstream>

#include "gateway/base/exit_code.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/release.h"

namespace baudgate {
namespace {

using Json = ControlClient::Json;

/// How long after this program's death the gateway takes its port back.
constexpr Duration kLoan = 2min;
constexpr Duration kRenewAfter = 30s;

}  // namespace

std::unique_ptr<LineLoan> LineLoan::Take(const std::string& line, const std::string& socket,
                                         std::ostream& err, int& code) {
  Json status;
  code = Ask(socket, {{"command", "status"}, {"target", line}}, status, err);
  if (code != 0) return nullptr;
  const Json shown = status.value("lines", Json::array({Json::object()})).at(0);
  std::ostringstream ignored;
  code = RunRelease({.line = line, .time = kLoan, .socket = socket}, ignored, err);
  if (code != 0) return nullptr;
  std::unique_ptr<LineLoan> loan(new LineLoan(line, socket, shown.value("port", "")));
  loan->renewed_ = ReadClocks().instant;
  return loan;
}

LineLoan::~LineLoan() {
  std::ostringstream ignored;
  RunRelease({.line = line_, .end = true, .socket = socket_}, ignored, ignored);
}

void LineLoan::Renew(Instant now) {
  if (now - renewed_ < kRenewAfter) return;
  renewed_ = now;
  Json answer;
  std::ostringstream ignored;  // a gateway that has ended needs its port no more
  Ask(socket_,
      {{"command", "release"},
       {"target", line_},
       {"for_ms", std::chrono::ceil<std::chrono::milliseconds>(kLoan).count()}},
      answer, ignored);
}

}  // namespace baudgate
