// SPDX-License-Identifier: Apache-2.0
// The view of the gateway's, the lines' and the devices' state, trouble first.
import {now} from './clock.js';
import {aged, barred, counted, heardAgo, lastHour, linked, marked, said} from './columns.js';
import {DataTable} from './data_table.js';
import {count, deviceAdvice, deviceTrouble, lineState, lineTrouble, micros, okShare, percent, plural} from './format.js';
import {deviceLink, lineLink} from './links.js';
import {Headline, Problem, section, Sentences} from './parts.js';
import {watchStatus} from './status.js';

const lineColumns = [
  marked('Port', (line) => [lineTrouble(line).shape, lineState(line)]),
  linked('Line', (line) => [line.name, lineLink(line.name)]),
  said(),
  barred('Use', (line) => [line.use, `${Math.round(line.use * 100)} %`]),
  counted('Exchanges', (line) => line.exchanges),
  counted('No reply', (line) => line.outcomes.no_reply),
  counted('Damaged', (line) => line.outcomes.corrupt + line.outcomes.partial),
  {title: 'Online', class: 'num', text: (line) => {
    const online = line.devices.filter((d) => d.state === 'online' || d.state === 'degraded').length;
    return `${online} of ${line.devices.length}`;
  }},
];

const deviceColumns = [
  marked('State', (device) => [deviceTrouble(device).shape, device.state]),
  linked('Device', (device) => [device.full, deviceLink({line: device.line, device: device.name})]),
  said(),
  aged('Answered', heardAgo),
  {title: 'OK', class: 'num', text: (device) => percent(okShare(device))},
  lastHour('Last hour'),
  {title: 'Mean round trip', class: 'num', text: (device) => micros(device.round_trips.mean_us)},
  {title: 'Good points', class: 'num', text: ({points}) => `${points.good} of ${points.count}`},
];

/** Returns the advice about the parts of the gateway that are not lines. */
export function gatewayAdvice(status) {
  const parts = [['DDS', status.dds], ['Events', status.events], ['History', status.history],
    ['Configuration', status.configuration], ['Audit', status.audit]];
  const list = parts.flatMap(([from, part]) => (part ? part.advice : []).map((text) => ({kind: 'warn', from, text})));
  for (const one of status.modbus.closed) {
    for (const text of one.advice) list.push({kind: 'bad', from: `Modbus ${one.listener}`, text});
  }
  for (const one of status.modbus.masters) {
    for (const text of one.advice) list.push({kind: 'warn', from: `Master on ${one.port}`, text});
  }
  for (const route of status.modbus.routes) {
    for (const text of route.advice) list.push({kind: 'warn', from: `Route ${route.units}`, text});
  }
  return list;
}

function health(status, devices) {
  const silent = devices.filter((d) => d.state === 'offline' || d.state === 'never seen').length;
  const degraded = devices.filter((d) => d.state === 'degraded').length;
  const closed = status.lines.filter((l) => l.port_state === 'closed').length;
  const lent = status.lines.filter((l) => l.port_state === 'released').length;
  const active = status.events ? status.events.alarms.active : 0;
  const are = (n, one, many) => `${count(n)} ${n === 1 ? one : many}`;
  const bad = [
    silent && `${are(silent, `of ${plural(devices.length, 'device')} does`, `of ${plural(devices.length, 'device')} do`)} not answer`,
    closed && are(closed, 'port is closed', 'ports are closed'),
    degraded && are(degraded, 'device is degraded', 'devices are degraded'),
    lent && are(lent, 'line is lent', 'lines are lent'),
    active && are(active, 'alarm is active', 'alarms are active'),
  ].filter(Boolean);
  if (bad.length) return [silent || closed ? 'bad' : 'warn', bad.join(', ')];
  if (!devices.length) return ['info', 'There are no devices in the configuration'];
  return ['fine', `All is well: ${are(devices.length, 'device answers', 'devices answer')}`];
}

export function overview(root) {
  const headline = new Headline('Overview');
  const problem = new Problem();
  const advice = new Sentences();
  const lines = new DataTable({columns: lineColumns, key: (l) => l.name, caption: 'Lines, trouble first',
    rowClass: (l) => `rank-${lineTrouble(l).shape}`});
  const devices = new DataTable({columns: deviceColumns, key: (d) => d.full, caption: 'Devices, trouble first',
    rowClass: (d) => `rank-${deviceTrouble(d).shape}`});
  root.append(headline.element, problem.element, advice.element, section('Lines', lines.element),
      section('Devices', devices.element));
  return watchStatus('', (status) => {
    problem.paint(null);
    const heard = now();
    const all = status.lines.flatMap((line) => line.devices.map((device) =>
      ({...device, line: line.name, full: `${line.name}.${device.name}`, advice: deviceAdvice(line, device), heard})));
    headline.paint(...health(status, all));
    advice.paint(gatewayAdvice(status));
    // Sorting is stable: within one rank the order of the configuration remains.
    lines.paint([...status.lines].sort((a, b) => lineTrouble(a).rank - lineTrouble(b).rank));
    devices.paint(all.sort((a, b) => deviceTrouble(a).rank - deviceTrouble(b).rank));
  }, (error) => problem.paint(error));
}
