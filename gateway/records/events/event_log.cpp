// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_log.h"

#include <utility>

namespace baudgate::events {

namespace {

LogOptions WithWriter(LogOptions options) {
  if (!options.writer) options.writer = std::make_shared<EventsWriter>();
  return options;
}

}  // namespace

EventLog::EventLog(Options options)
    : options_(WithWriter(std::move(options))),
      pending_(options_, [this] { worker_.Wake(); }),
      queue_(options_, pending_),
      rounds_(options_, pending_),
      round_writer_(options_, queue_, rounds_),
      worker_(options_.writer->thread, [this](bool last) { return round_writer_.Run(last); }) {
  round_writer_.Serve();
  worker_.Start();
}

EventLog::~EventLog() {
  round_writer_.StopServing();
  queue_.TellEnd();
  worker_.Stop();
  for (const std::string& line : rounds_.LeftBehind()) options_.warn(line);
}

EventsState EventLog::state() const {
  EventsState state = queue_.state();
  state.consumers = round_writer_.Consumers(state.oldest);
  return state;
}

Result<Page> EventLog::Read(const PageQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return Page{.records = {}, .next = query.after};
  bool damaged = false;
  auto page = ReadPage(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

Result<PastPage> EventLog::ReadPast(const PastQuery& query) const {
  if (options_.file.empty()) return Error{options_.why_no_file};
  if (state().disk == Disk::opening) return PastPage{.rows = {}, .next = query.after};
  bool damaged = false;
  auto page = events::ReadPast(options_.file, query, &damaged);
  if (damaged) rounds_.Doubt();
  return page;
}

}  // namespace baudgate::events
