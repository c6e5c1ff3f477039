// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch_any.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/tools/terminal/stop_signals.h"
#include "gateway/tools/watch/line_loop.h"
#include "gateway/tools/watch/mailbox.h"

namespace baudgate {
namespace {

struct Line {
  std::string text;
  bool is_news = false;  ///< about a topic, no sample
};

bool Matches(const dds::AnySample& sample, const WatchOptions& options) {
  const auto is = [&](const std::string& name, const std::string& wanted) {
    return wanted.empty() || std::ranges::any_of(sample.fields, [&](const dds::AnyField& field) {
             return field.name == name && field.text == wanted;
           });
  };
  return is("gateway", options.gateway) && is("device", options.device) &&
         is("point", options.point);
}

}  // namespace

std::string PlainLine(const dds::AnySample& sample) {
  std::string line = sample.topic + " ";
  for (const dds::AnyField& field : sample.fields) line += " " + field.name + "=" + field.text;
  return Harmless(line);
}

std::string JsonLine(const dds::AnySample& sample) {
  const auto quote = [](const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  std::string line = "{\"topic\":" + quote(sample.topic) + ",\"type\":" + quote(sample.type);
  const auto value = [&quote](const dds::AnyField& field) -> std::string {
    if (field.form == dds::AnyField::Form::none) return "null";
    return field.form == dds::AnyField::Form::text ? quote(field.text) : field.text;
  };
  for (const dds::AnyField& field : sample.fields) {
    line += "," + quote(field.name) + ":" + value(field);
  }
  return line + "}";
}

int RunWatchAny(const WatchOptions& options, std::ostream& out, std::ostream& err) {
  const StopSignals signals;  // before the library's threads, which inherit the mask
  Mailbox<Line> mailbox;
  const auto on_sample = [&](const dds::AnySample& sample) {
    if (!Matches(sample, options)) return;
    mailbox.Put({options.json ? JsonLine(sample) : PlainLine(sample)});
  };
  const auto on_topic = [&](const std::string& topic, const std::string& type,
                            const std::string& why) {
    const std::string what = why.empty() ? "is read" : "is not read: " + why;
    mailbox.Put({Harmless("watch: topic " + topic + " (" + type + ") " + what), true});
  };
  std::unique_ptr<dds::AnySubscriber> subscriber;
  Listening listening(options.interfaces, [&] {
    return MakeAnew(subscriber, mailbox, [&] {
      return dds::AnySubscriber::Create(ParticipantOf(options), {on_sample, on_topic});
    });
  });
  if (const Status status = listening.Start(); !status) {
    err << "watch: " << status.error() << '\n';
    return kExitCanNot;
  }
  bool heard = false;
  const auto print = [&] {
    for (const Line& line : mailbox.TakeAll()) {
      heard = true;
      (line.is_news ? err : out) << line.text << '\n';
    }
  };
  RunLineLoop({signals, options.seconds, mailbox.descriptor(), print}, listening, out, err);
  mailbox.Close();
  if (heard) return kExitDone;
  err << "watch: no topic whose type is announced in DDS domain " << options.domain
      << "; not every publisher announces its types\n";
  return kExitCanNot;
}

}  // namespace baudgate
