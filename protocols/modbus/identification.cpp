// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/identification.h"

#include <utility>

#include "protocols/common/designation.h"
#include "protocols/modbus/named_places.h"

namespace baudgate::protocols::modbus {

std::optional<Bytes> Identification::Next() {
  if (identity_.names.empty() || identity_.ignore) return std::nullopt;
  if (std::exchange(again_, false)) OnReconnect();
  if (done_) return std::nullopt;
  const bool objects = step_ == Step::objects;
  asked_ = ReadOf({objects ? Space{Table::identity, kBasic} : Space{Table::server, 0}, 0, 1, 1});
  return asked_;
}

void Identification::OnAnswer(const std::optional<Data>& data) {
  std::vector<std::string> names;
  if (data && step_ == Step::server) names = {data->texts.at(0)};
  if (data && step_ == Step::objects && data->texts.contains(kProduct)) {
    const auto vendor = data->texts.find(kVendor);
    names = {data->texts.at(kProduct)};
    if (vendor != data->texts.end()) names.push_back(vendor->second + " " + names[0]);
  }
  std::erase_if(names, [](const std::string& name) { return config::SpokenName(name).empty(); });
  const bool silent = names.empty();
  if (!silent) Judge(names);
  done_ = !silent || step_ == Step::server;
  step_ = step_ == Step::objects ? Step::server : Step::over;
}

/// One that its profile lists outweighs the others.
void Identification::Judge(const std::vector<std::string>& names) {
  trouble_ = {};
  DeviceTrouble worst;
  for (const std::string& name : names) {
    DeviceTrouble found = JudgeName(identity_, name);
    if (found.text.empty()) return;
    if (worst.text.empty() || (found && !worst)) worst = std::move(found);
  }
  trouble_ = std::move(worst);
}

void Identification::OnReconnect() {
  step_ = Step::objects;
  done_ = false;
}

}  // namespace baudgate::protocols::modbus
