// Helpers of the benchmarks. Every result is a ratio to a limit that is measured in the same run.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::bench {

double Median(std::vector<double> values);
double Percentile(std::vector<double> values, double share);

std::string Scratch();
config::Config Load(const std::string& yaml, const config::Catalog& catalog);
struct Totals {
  std::uint64_t exchanges = 0;
  std::uint64_t failed = 0;
  std::uint64_t missed = 0;
  std::uint64_t readings = 0;
};
Totals Sum(const bus::PointStore& store);
double CpuSeconds(pid_t process);
/// Returns a number of /proc/PID/status, for example VmRSS in KiB; 0 if the key is missing.
double StatusOf(pid_t process, const std::string& key);
const char* Verdict(bool reached);

void RunLineUse(const config::Catalog& catalog);
void RunDeadDevices(const config::Catalog& catalog);
void RunModbusRate();
void RunTls();
void RunAddedDelay(const config::Catalog& catalog, const std::string& self);
void RunScale(const config::Catalog& catalog, const std::string& self);
void RunCostPerPoint();
void RunCrowd(const std::string& self);
void RunRivals();
void RunHistory();
void RunDdsHarm(const std::string& self);
void RunDrive(const config::Catalog& catalog);
void RunRoutes(const config::Catalog& catalog);
void RunTagDelay(const config::Catalog& catalog);

// Entry points of child processes of the same program: `self ROLE ARGS…`.
int BeDelaySubscriber(int argc, char** argv);
int BeDelayRelay(int argc, char** argv);
int BeScaleTwins(const config::Catalog& catalog, int argc, char** argv);
int BeScaleSubscriber(int argc, char** argv);
int BeCrowdSlaves(const config::Catalog& catalog, int argc, char** argv);
int BeCrowdGateway(const config::Catalog& catalog, int argc, char** argv);

}  // namespace baudgate::bench
