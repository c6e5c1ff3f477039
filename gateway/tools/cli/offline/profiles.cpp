// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/profiles.h"

#include <nlohmann/json.hpp>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/spelling.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/type_text.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;
using config::ProfileFile;
using config::TextTable;

std::string TableText(const config::Point& point) {
  if (!point.modbus) return "";
  const bool bit = point.table == config::Table::bits;
  if (point.access == config::Access::read) return bit ? "discrete" : "input";
  return bit ? "coil" : "holding";
}

std::string RegisterText(const config::Point& point) {
  if (!point.modbus) return "";
  const std::size_t count = point.table == config::Table::bits ? 1 : config::RegisterCount(point);
  const std::string first = std::to_string(*point.modbus);
  return count == 1 ? first : first + "…" + std::to_string(*point.modbus + count - 1);
}

TextTable PointTable(const config::Profile& profile) {
  TextTable table(
      {"point", "register", "table", "type", "unit", "access", "group", "read", "description"});
  for (const config::Point& point : profile.points) {
    table.Add({point.name, RegisterText(point), TableText(point), TypeText(point), point.unit,
               std::string(config::Name(point.access)), config::PeriodText(point), point.read,
               point.description});
  }
  return table;
}

Json ToJson(const config::Profile& profile) {
  Json points = Json::array();
  for (const config::Point& point : profile.points) {
    Json one = {{"name", point.name},
                {"modbus", point.modbus ? Json(*point.modbus) : Json()},
                {"table", TableText(point)},
                {"registers", config::RegisterCount(point)},
                {"type", TypeText(point)},
                {"unit", point.unit},
                {"access", config::Name(point.access)},
                {"group", config::PeriodText(point)},
                {"read", point.read},
                {"description", *point.description}};
    if (!point.write.empty()) one["write"] = point.write;
    points.push_back(std::move(one));
  }
  return {{"protocol", profile.protocol},
          {"profile", profile.name},
          {"device", profile.title},
          {"points", std::move(points)}};
}

void PrintJson(const Json& json, std::ostream& out) {
  out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

// A profile that cannot be read still stands in the list, without its title.
int PrintList(const std::vector<ProfileFile>& files, ProfileFormat format, std::size_t width,
              const config::Catalog& catalog, std::ostream& out) {
  TextTable table({"protocol", "profile", "points", "device", "of this machine"});
  Json list = Json::array();
  for (const ProfileFile& file : files) {
    const Protocol* protocol = catalog.FindProtocol(file.protocol);
    if (!protocol) continue;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, catalog);
    const std::string title = loaded.ok() ? loaded.profile.title : "(bad; see profiles NAME)";
    const std::size_t points = loaded.profile.points.size();
    const std::string path = file.path.string();
    const bool local = path.starts_with(config::kLocalProfiles);
    table.Add({file.protocol, file.name, std::to_string(points), title, local ? path : ""});
    list.push_back({{"protocol", file.protocol},
                    {"profile", file.name},
                    {"device", title},
                    {"points", points},
                    {"file", path},
                    {"ok", loaded.ok()}});
  }
  switch (format) {
    case ProfileFormat::json:
      PrintJson(list, out);
      break;
    case ProfileFormat::markdown:
      table.PrintMarkdown(out);
      break;
    case ProfileFormat::table:
      table.PrintAligned(out, "", width);
      break;
  }
  return 0;
}

std::vector<ProfileFile> Matching(const std::vector<ProfileFile>& files, const std::string& name) {
  std::vector<ProfileFile> matching;
  for (const ProfileFile& file : files) {
    if (name == file.name || name == file.protocol + "/" + file.name) matching.push_back(file);
  }
  return matching;
}

void ExplainMiss(const std::string& name, const std::vector<ProfileFile>& matching,
                 const std::vector<ProfileFile>& files, std::ostream& err) {
  std::vector<std::string_view> names;
  if (matching.empty()) {
    for (const ProfileFile& file : files) names.push_back(file.name);
    err << "profile " << config::Quoted(name) << " is not installed;"
        << config::DidYouMean(name, names)
        << " installed: " << (names.empty() ? "none" : config::Join(names)) << '\n';
    return;
  }
  err << "several protocols have a profile " << config::Quoted(name) << "; write";
  for (const ProfileFile& file : matching) err << ' ' << file.protocol << '/' << file.name;
  err << '\n';
}

}  // namespace

void PrintProfile(const config::Profile& profile, ProfileFormat format, std::size_t width,
                  std::ostream& out) {
  if (format == ProfileFormat::json) return PrintJson(ToJson(profile), out);
  const bool markdown = format == ProfileFormat::markdown;
  out << (markdown ? "## " : "") << profile.title << " (" << profile.protocol << "/" << profile.name
      << ", " << profile.points.size() << " points)\n\n";
  const TextTable table = PointTable(profile);
  if (markdown) {
    table.PrintMarkdown(out);
  } else {
    table.PrintAligned(out, "", width);
  }
}

int RunProfiles(const std::string& name, ProfileFormat format, const config::Catalog& catalog,
                std::ostream& out, std::ostream& err, std::size_t width) {
  if (const Status any = catalog.HasProtocols(); !any) {
    err << "baudgate: " << any.error() << '\n';
    return kExitCanNot;
  }
  const std::vector<ProfileFile> files = catalog.Profiles();
  if (name.empty()) return PrintList(files, format, width, catalog, out);
  const std::vector<ProfileFile> matching = Matching(files, name);
  if (matching.size() != 1) {
    ExplainMiss(name, matching, files, err);
    return kExitUsage;
  }
  const Protocol* protocol = catalog.FindProtocol(matching.front().protocol);
  if (!protocol) {
    err << "profile " << config::Quoted(name) << " is for protocol " << matching.front().protocol
        << ", which is not installed\n";
    return kExitUsage;
  }
  const auto loaded = config::LoadProfile(matching.front().path.string(), *protocol, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) return kExitBadConfiguration;
  PrintProfile(loaded.profile, format, width, out);
  return 0;
}

}  // namespace baudgate
