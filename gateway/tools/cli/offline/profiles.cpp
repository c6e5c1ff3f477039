// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/profiles.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/text.h"
#include "gateway/base/whole_file.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

using Json = nlohmann::ordered_json;

std::string_view KindName(protocols::OptionSpec::Kind kind) {
  switch (kind) {
    case protocols::OptionSpec::Kind::flag:
      return "true or false";
    case protocols::OptionSpec::Kind::integer:
      return "whole number";
    case protocols::OptionSpec::Kind::real:
      return "number";
    case protocols::OptionSpec::Kind::text:
      return "text";
    case protocols::OptionSpec::Kind::duration:
      return "duration";
    case protocols::OptionSpec::Kind::choice:
      return "choice";
    case protocols::OptionSpec::Kind::texts:
      return "list of texts";
    case protocols::OptionSpec::Kind::pairs:
      return "map of texts";
    case protocols::OptionSpec::Kind::description:
      return "map";
  }
  return "text";
}

std::string Allowed(const protocols::OptionSpec& option) {
  if (option.kind == protocols::OptionSpec::Kind::choice) return std::string(option.choices);
  const bool is_number = option.kind == protocols::OptionSpec::Kind::integer ||
                         option.kind == protocols::OptionSpec::Kind::real;
  if (!is_number || option.minimum >= option.maximum) return "";
  return FormatNumber(option.minimum) + "…" + FormatNumber(option.maximum);
}

std::string_view ScopeName(const protocols::OptionSpec& option) {
  return option.scope == protocols::OptionSpec::Scope::line ? "line" : "device";
}

/// Rounds to 0.1 ms for printing, because times that are computed from a bit rate have nanoseconds.
Duration Rounded(Duration time) {
  return Duration(std::chrono::round<std::chrono::milliseconds>(10 * time)) / 10;
}

void PrintTimes(const protocols::Protocol& protocol, std::ostream& out) {
  const config::Timing timing = protocol.timing(protocol.serial);
  out << "\nDefaults\n";
  if (!protocol.tcp) out << "  serial: " << protocol.serial.ToString() << '\n';
  out << "  timing: {";
  const char* between = " ";
  for (const auto& [name, time] :
       {std::pair("quiet", timing.quiet), std::pair("reply", timing.reply),
        std::pair("gap", timing.gap), std::pair("ceiling", timing.ceiling),
        std::pair("drain", timing.drain)}) {
    if (!time) continue;
    out << between << name << ": " << FormatDuration(Rounded(*time));
    between = ", ";
  }
  out << " }\n";
}

void PrintOne(const protocols::Protocol& protocol, std::ostream& out) {
  out << protocol.name << ": " << protocol.title << '\n';
  if (!protocol.options.empty()) {
    out << "\nOptions\n";
    for (const protocols::OptionSpec& option : protocol.options) {
      const std::string allowed = Allowed(option);
      out << "  " << option.name << " (" << ScopeName(option) << "; " << KindName(option.kind)
          << (allowed.empty() ? "" : ": " + allowed) << "; default "
          << (option.fallback.empty() ? "empty" : option.fallback)
          << (option.secret ? "; secret" : "") << ")\n      " << option.help << '\n';
    }
  }
  if (!protocol.decoders.empty()) {
    out << "\nForms of `read`\n";
    TextTable table({"form", "meaning"});
    for (const protocols::DecoderSpec& decoder : protocol.decoders) {
      table.Add({std::string(decoder.form), std::string(decoder.help)});
    }
    table.PrintAligned(out, "  ");
  }
  PrintTimes(protocol, out);
}

Json ToJson(const protocols::Protocol& protocol) {
  Json options = Json::array();
  for (const protocols::OptionSpec& option : protocol.options) {
    options.push_back({{"name", option.name},
                       {"scope", ScopeName(option)},
                       {"kind", KindName(option.kind)},
                       {"allowed", Allowed(option)},
                       {"default", option.fallback},
                       {"secret", option.secret},
                       {"help", option.help}});
  }
  Json decoders = Json::array();
  for (const protocols::DecoderSpec& decoder : protocol.decoders) {
    decoders.push_back({{"form", decoder.form}, {"help", decoder.help}});
  }
  return {{"name", protocol.name},
          {"title", protocol.title},
          {"serial", protocol.tcp ? Json() : Json(protocol.serial.ToString())},
          {"options", std::move(options)},
          {"decoders", std::move(decoders)}};
}

void PrintList(const config::Catalog& catalog, std::ostream& out) {
  TextTable table({"protocol", "title", "profiles"});
  for (const auto& [name, protocol] : catalog.protocols) {
    table.Add({name, std::string(protocol->title), std::to_string(catalog.Profiles(name).size())});
  }
  table.PrintAligned(out);
}

}  // namespace

int RunProtocols(const std::string& name, bool json, const config::Catalog& catalog,
                 std::ostream& out, std::ostream& err) {
  if (const Status any = catalog.HasProtocols(); !any) {
    err << "baudgate: " << any.error() << '\n';
    return kExitCanNot;
  }
  const protocols::Protocol* one = name.empty() ? nullptr : catalog.FindProtocol(name);
  if (!name.empty() && !one) {
    const std::vector<std::string_view> installed = catalog.ProtocolNames();
    err << "protocol " << Quoted(name) << " is not installed;" << DidYouMean(name, installed)
        << " installed: " << (installed.empty() ? "none" : Join(installed)) << '\n';
    return kExitUsage;
  }
  if (json) {
    Json result = one ? ToJson(*one) : Json::array();
    if (!one) {
      for (const auto& [key, protocol] : catalog.protocols) result.push_back(ToJson(*protocol));
    }
    out << result.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  } else if (one) {
    PrintOne(*one, out);
  } else {
    PrintList(catalog, out);
  }
  return 0;
}

namespace {

using Json = nlohmann::ordered_json;
using config::ProfileFile;

std::string TableText(const config::Point& point) {
  return point.modbus ? std::string(config::TableName(point)) : "";
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

// A profile that cannot be read is listed without its title.
int PrintList(const std::vector<ProfileFile>& files, ProfileFormat format, std::size_t width,
              const config::Catalog& catalog, std::ostream& out) {
  TextTable table({"protocol", "profile", "points", "device", "of this machine"});
  Json list = Json::array();
  for (const ProfileFile& file : files) {
    const protocols::Protocol* protocol = catalog.FindProtocol(file.protocol);
    if (!protocol) continue;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, catalog);
    const std::string title =
        loaded.ok() ? loaded.profile.title : "(has errors; run 'baudgate profiles NAME')";
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
    err << "profile " << Quoted(name) << " is not installed;" << DidYouMean(name, names)
        << " installed: " << (names.empty() ? "none" : Join(names)) << '\n';
    return;
  }
  err << "several protocols have a profile " << Quoted(name) << "; write";
  for (const ProfileFile& file : matching) err << ' ' << file.protocol << '/' << file.name;
  err << '\n';
}

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

}  // namespace

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
  const protocols::Protocol* protocol = catalog.FindProtocol(matching.front().protocol);
  if (!protocol) {
    err << "profile " << Quoted(name) << " is for protocol " << matching.front().protocol
        << ", which is not installed\n";
    return kExitUsage;
  }
  const auto loaded = config::LoadProfile(matching.front().path.string(), *protocol, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) return kExitBadConfiguration;
  PrintProfile(loaded.profile, format, width, out);
  return 0;
}

namespace {

namespace fs = std::filesystem;

struct Judged {
  const protocols::Protocol* protocol = nullptr;
  config::LoadedProfile loaded;
};

std::size_t Errors(const std::vector<config::Problem>& problems) {
  return static_cast<std::size_t>(
      std::ranges::count_if(problems, [](const auto& problem) { return !problem.warning; }));
}

void AddDoubts(Judged& judged) {
  const protocols::Protocol& protocol = *judged.protocol;
  if (protocol.doubts == nullptr) return;
  for (const char* address : {"1", "0"}) {
    if (!protocol.canonical_address(address)) continue;
    const auto device = config::DeviceFromProfile(judged.loaded.profile, protocol, "x", address);
    for (const protocols::ConfigRemark& doubt : protocol.doubts(device)) {
      if (doubt.point >= device.points.size()) continue;
      const config::Point& point = device.points[doubt.point];
      judged.loaded.problems.push_back(
          {point.mark, "point '" + point.name + "' " + doubt.text, true});
    }
    return;
  }
}

Judged Judge(const std::string& text, const std::string& file, const protocols::Protocol& protocol,
             const config::Catalog& catalog) {
  const std::string name = fs::path(file).stem().string();
  return {&protocol, config::LoadProfileText(text, file, name, protocol, catalog)};
}

/// Checks the file as a profile of the protocol that has the name of its folder. If there is none,
/// checks it for each protocol and returns the result with the fewest errors.
Judged JudgeByContent(const std::string& text, const std::string& file,
                      const config::Catalog& catalog) {
  const std::string folder = fs::absolute(file).parent_path().filename().string();
  if (const protocols::Protocol* protocol = catalog.FindProtocol(folder)) {
    return Judge(text, file, *protocol, catalog);
  }
  std::optional<Judged> best;
  for (const auto& [name, protocol] : catalog.protocols) {
    if (!protocol->profiles_of.empty()) continue;
    Judged judged = Judge(text, file, *protocol, catalog);
    if (!best || Errors(judged.loaded.problems) < Errors(best->loaded.problems)) {
      best = std::move(judged);
    }
  }
  return best ? std::move(*best) : Judged{};
}

}  // namespace

int RunCheckProfile(const CheckProfileOptions& options, const config::Catalog& catalog,
                    std::ostream& out, std::ostream& err) {
  const auto text = ReadWhole(options.file);
  if (!text) {
    err << "baudgate: cannot read " << options.file << "\n";
    return kExitCanNot;
  }
  Judged judged;
  if (options.protocol.empty()) {
    judged = JudgeByContent(*text, options.file, catalog);
  } else {
    const auto protocol = catalog.NeedProtocol(options.protocol);
    if (!protocol) {
      err << "baudgate: --protocol: " << protocol.error() << "\n";
      return kExitUsage;
    }
    judged = Judge(*text, options.file, **protocol, catalog);
  }
  if (judged.protocol == nullptr) {
    err << "baudgate: no protocol is installed; install the package again\n";
    return kExitCanNot;
  }
  if (judged.loaded.ok()) AddDoubts(judged);
  PrintProblems(judged.loaded.problems, err);
  const std::string as = "a profile of " + std::string(judged.protocol->name);
  if (!judged.loaded.ok()) {
    const std::size_t errors = Errors(judged.loaded.problems);
    err << options.file << ": " << errors << (errors == 1 ? " error" : " errors") << ", read as "
        << as << (options.protocol.empty() ? "; for another protocol add --protocol" : "") << '\n';
    return kExitBadConfiguration;
  }
  PrintProfile(judged.loaded.profile, options.format, options.width, out);
  return kExitDone;
}

}  // namespace baudgate::tools
