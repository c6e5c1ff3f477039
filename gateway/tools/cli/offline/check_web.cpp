// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_web.h"

#include "gateway/outputs/web/series.h"
#include "gateway/outputs/web/token_file.h"

namespace baudgate {

void CheckWebToken(const config::Config& config, std::vector<config::Problem>& problems) {
  if (!config.web.on || config.web.token_file.empty()) return;
  const auto token = web::ReadToken(config.web.token_file);
  // `check` may run as another user, who cannot read the token file.
  if (!token) problems.push_back({config.web.token_mark, "file: " + token.error(), true});
}

void PrintWeb(const config::Config& config, std::ostream& out) {
  const config::Web& web = config.web;
  if (!web.on) {
    out << "web off\n";
    return;
  }
  out << "web http://" << web.Place() << "/, ";
  out << (web.token_file.empty() ? "without a token" : "with the token of " + web.token_file);
  for (std::size_t i = 0; i < web.allow.size(); ++i) {
    out << (i == 0 ? ", for " : ", ") << web.allow[i].text;
  }
  if (web.allow.empty()) out << ", for everybody who reaches it";
  if (web.acknowledge) out << "; alarms may be acknowledged";
  out << "\n  metrics    at most " << web::SeriesOf(config) << " series\n";
}

nlohmann::ordered_json WebJson(const config::Config& config) {
  if (!config.web.on) return nullptr;
  return {{"listen", config.web.Place()},
          {"token", !config.web.token_file.empty()},
          {"series", web::SeriesOf(config)}};
}

}  // namespace baudgate
