// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/output_list.h"

#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/daemon/descriptors.h"
#include "gateway/daemon/reloader.h"
#include "gateway/lines/lines.h"
#include "gateway/outputs/control/control_server.h"
#include "gateway/outputs/dds/output/dds_output.h"
#include "gateway/outputs/modbus/server/modbus_output.h"
#include "gateway/outputs/mqtt/mqtt_output.h"
#include "gateway/outputs/remote_write/remote_write_output.h"
#include "gateway/outputs/web/web_output.h"
#include "gateway/records/records.h"

namespace baudgate::daemon {
namespace {

std::unique_ptr<outputs::Output> MakeControl(const OutputLinks& links) {
  return std::make_unique<control::ControlOutput>(
      links.config, control::ControlOutput::Links{links.store, links.control, links.commands,
                                                  links.info, links.reloader});
}

std::unique_ptr<outputs::Output> MakeWeb(const OutputLinks& links) {
  web::LiveApi::Links api{links.store, links.control, links.info, &links.commands};
  api.protocol = [&catalog = links.catalog](const std::string& name) {
    return catalog.FindProtocol(name);
  };
  if (links.reloader != nullptr) {
    api.reload = links.reloader;
    api.configuration = [reloader = links.reloader] { return reloader->ConfigurationText(); };
  }
  outputs::DescriptorNeeds needs = links.needs(links.config);
  needs.viewers = web::WebOutput::kDescriptors;
  const std::size_t limit = RaiseDescriptorLimit(needs.all());
  return std::make_unique<web::WebOutput>(std::move(api),
                                          web::Limits::Of(ViewerShare(needs, limit)));
}

modbus::GatewayFigures FiguresOf(const bus::PointStore& store, const lines::Lines& lines,
                                 Instant started) {
  modbus::GatewayFigures info;
  info.version_major = kVersionMajor;
  info.version_minor = kVersionMinor;
  info.version_patch = kVersionPatch;
  info.uptime = ReadClocks().instant - started;
  info.lines = lines.present();
  info.lines_up = lines.open();
  info.devices = store.present_count();
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device)) continue;
    store.Read(device, [&](const bus::DeviceRecord& record) {
      // A device keeps its state while its line is down, so override_quality is checked as well.
      info.devices_online += Answers(record.status.state) && !record.override_quality ? 1 : 0;
    });
  }
  return info;
}

records::RoutedEnd::Slave SlaveOf(modbus::RouteOutcome end) {
  using modbus::RouteOutcome;
  using Slave = records::RoutedEnd::Slave;
  if (end == RouteOutcome::ok || end == RouteOutcome::refused) return Slave::answered;
  return end == RouteOutcome::no_reply ? Slave::silent : Slave::unknown;
}

std::unique_ptr<outputs::Output> MakeModbus(const OutputLinks& links) {
  modbus::ModbusLinks server;
  server.frames = {links.catalog.FramesOf(modbus::Framing::rtu),
                   links.catalog.FramesOf(modbus::Framing::ascii)};
  server.journal = links.info.journal;
  if (records::WritePath* const writes = links.records.write_path()) server.writes = &writes->log();
  if (records::EventPath* const events = links.records.events()) {
    server.events = events->feed();
    server.alarms = &events->log();
    server.routed = [events](const modbus::RoutedReport& end, Now now) {
      events->OnRouted({end.route, end.unit, SlaveOf(end.end), end.reply}, now);
    };
  }
  const auto figures = [&store = links.store, &lines = links.lines, started = links.info.started] {
    return FiguresOf(store, lines, started);
  };
  const auto make_room = [needs_of = links.needs](const config::Config& config) {
    const outputs::DescriptorNeeds needs = needs_of(config);
    const std::size_t limit = RaiseDescriptorLimit(needs.all());
    const double share = ClientShare(needs, limit);
    if (share < 1) log::Warn("modbus: {}", ExplainClientShare(needs, limit));
    return share;
  };
  const auto targets = [&lines = links.lines] {
    std::vector<bus::RouteTarget*> all;
    for (std::uint32_t line = 0; line < lines.size(); ++line) all.push_back(&lines.at(line));
    return all;
  };
  return std::make_unique<modbus::ModbusOutput>(modbus::ModbusOutput::Links{
      links.store, links.commands, figures, make_room, targets, std::move(server)});
}

std::unique_ptr<outputs::Output> MakeDds(const OutputLinks& links) {
  records::Records& records = links.records;
  records::WritePath* const writes = records.write_path();
  const audit::AuditSource* const audit = writes != nullptr ? &writes->log() : nullptr;
  dds::DdsOutput::Links dds{links.store, links.commands, [audit] { return audit::PastOf(audit); }};
  if (const records::EventPath* const events = records.events()) {
    dds.events = std::make_shared<dds::EventSamples>(links.config.name, events->feed(),
                                                     events->cursors(), records.keeps_events());
  }
  dds.keeps_events = records.keeps_events();
  return std::make_unique<dds::DdsOutput>(std::move(dds));
}

/// Returns a function that raises and ends the alarms of an outlet.
outlet::TellAlarms TellAlarmsOf(const OutputLinks& links, const std::string& name) {
  return [&records = links.records, name](const outlet::OutletAlarms& alarms, Now now) {
    if (auto* const events = records.events()) {
      events->OnOutlet(name, alarms.away, alarms.refused, now);
    }
  };
}

std::unique_ptr<outputs::Output> MakeMqtt(const OutputLinks& links) {
  const records::Records& records = links.records;
  mqtt::MqttOutput::Links mqtt{links.store, links.commands};
  if (const records::EventPath* const events = records.events()) {
    mqtt.feed = events->feed();
    mqtt.cursors = events->cursors();
  }
  mqtt.keeps_events = records.keeps_events();
  if (records.state() != nullptr) mqtt.state = records.state()->path();
  mqtt.why_no_state = records.why_no_state();
  mqtt.alarms = TellAlarmsOf(links, "mqtt");
  return std::make_unique<mqtt::MqttOutput>(std::move(mqtt));
}

std::unique_ptr<outputs::Output> MakeRemoteWrite(const OutputLinks& links) {
  const records::StateFolder* const state = links.records.state();
  remote_write::RemoteWriteOutput::Links its;
  if (state != nullptr) its.folder = state->path();
  its.why_no_folder = links.records.why_no_state();
  its.alarms = TellAlarmsOf(links, "remote_write");
  return std::make_unique<remote_write::RemoteWriteOutput>(std::move(its));
}

}  // namespace

OutputRows AllOutputs() {
  return {
      // kForGateway (gateway/daemon/descriptors.cpp) contains the descriptors of the control
      // socket.
      {&MakeControl},
      {&MakeWeb, &web::WebOutput::Descriptors},
      {&MakeModbus, &modbus::ModbusOutput::Descriptors},
      {&MakeMqtt, &mqtt::MqttOutput::Descriptors, &mqtt::MqttOutput::Consumer},
      {&MakeRemoteWrite, &remote_write::RemoteWriteOutput::Descriptors},
      {&MakeDds, &dds::DdsOutput::Descriptors, &dds::DdsOutput::Consumer},
  };
}

}  // namespace baudgate::daemon
