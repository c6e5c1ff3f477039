// An output whose status and sentences the test sets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gateway/outputs/output.h"

namespace baudgate::outputs {

class FakeOutput final : public Output {
 public:
  FakeOutput(std::string name, Json section, std::vector<Series> metrics = {})
      : name_(std::move(name)), section_(std::move(section)), metrics_(std::move(metrics)) {}

  std::string_view name() const override { return name_; }
  std::optional<Json> Section(const Wish&) const override { return section_; }
  std::vector<Series> Metrics() const override { return metrics_; }

 private:
  const std::string name_;
  const Json section_;
  const std::vector<Series> metrics_;
};

}  // namespace baudgate::outputs
