// SPDX-License-Identifier: Apache-2.0
// Makes one list of everything that is wrong, worst first: the gateway's sentences, and the alarms that belong to them.
import {alarmSource, unseen} from './alarm_bar.js';
import {now} from './clock.js';
import {civilSeconds, deviceAdvice, deviceTrouble, inWords, lineState, listed, plural, stateWord, who} from './format.js';
import {deviceLink, lineLink, sourceLink} from './links.js';

/** One scale for alarms and for problems without an alarm. */
const priorities = ['high', 'medium', 'low', 'hint'];
const ofKind = {bad: 'medium', new: 'medium', warn: 'low', info: 'hint'};

/** Splits a sentence of the gateway into the cause and the remedy. The time since when it is so is shown elsewhere. */
export function causeAndRemedy(sentence) {
  const text = inWords(sentence).replace(/^(?:port closed|offline|silent) for [^:]+: /, '');
  const stop = text.search(/\. [A-Z]/);
  if (stop >= 0) return [text.slice(0, stop), text.slice(stop + 2)];
  const half = text.search(/; [^()]*$/);
  return half < 0 ? [text, ''] : [text.slice(0, half), text.slice(half + 2)];
}

const time = (text) => (text ? Date.parse(text) : null);
const isNote = (text) => text.startsWith('note:');
const silent = (device) => device.state === 'offline' || device.state === 'never seen';

/** Returns the user who has disabled a device, and since when; empty: not known, or disabled by the configuration. */
export const disabledText = ({disabled}) => (disabled ? `disabled by ${who(disabled.by)} since ${civilSeconds(disabled.since)}` : '');

export const inMaintenance = (device, line) => Boolean(device.maintenance) || device.state === 'disabled' || line.port_state === 'released';

function problem(key, kind, subject, href, word, since, sentences, rest = {}) {
  const [cause, remedy] = causeAndRemedy(sentences[0] || '');
  return {key, kind, subject, href, word, since, cause, remedy, more: sentences.slice(1).map(inWords), alarms: [], ...rest};
}

/** The fault of a whole line: its port, its ring, or that no device answers. The devices that are away with it are named once. */
function lineProblems(line) {
  const fault = line.port_state === 'closed' || line.stuck_since || line.echo_lost_since;
  const advice = line.advice.filter((text) => !isNote(text));
  const shared = fault || advice.some((text) => text.startsWith('none of its'));
  if (line.port_state === 'released' || (!shared && !advice.length)) return {list: [], away: []};
  const away = shared ? line.devices.filter((d) => silent(d) && !inMaintenance(d, line)).map((d) => d.name) : [];
  const sentences = advice.length ? advice : [line.port_text];
  const since = time(line.port_state === 'closed' ? line.port_since : line.stuck_since || line.echo_lost_since || null);
  const one = problem(`line ${line.name}`, shared ? 'bad' : 'info', `Line ${line.name}`, lineLink(line.name), lineState(line), since, sentences);
  if (away.length) one.with = `${listed(away)} ${away.length === 1 ? 'is' : 'are'} away with it`;
  return {list: [one], away};
}

function deviceProblem(line, device) {
  const {shape} = deviceTrouble(device);
  const sentences = [...(device.trouble ? [device.trouble] : []), ...deviceAdvice(line, device)].filter((text) => !isNote(text));
  if (shape === 'fine' || (shape === 'info' && !sentences.length)) return null;
  const name = `${line.name}.${device.name}`;
  return problem(`device ${name}`, shape, name, deviceLink({line: line.name, device: device.name}), stateWord(device),
      silent(device) && device.age_ms !== null ? now() - device.age_ms : null, sentences);
}

/** Problems of the parts of the gateway that are not lines. */
export function gatewayProblems(status) {
  const list = [];
  const add = (kind, subject, sentences, href = '#/system') => {
    const real = (sentences || []).filter((text) => !isNote(text));
    if (real.length) list.push(problem(`part ${subject}`, kind, subject, href, '', null, real));
  };
  for (const [name, key, at] of [['DDS', 'dds', 'dds'], ['Events', 'events', 'records'], ['History', 'history', 'records'],
    ['Audit', 'audit', 'records'], ['Configuration', 'configuration', 'configuration'], ['Files', 'files', ''], ['Page', 'web', ''],
    ['MQTT', 'mqtt', ''], ['Remote write', 'remote_write', '']]) add('warn', name, status[key]?.advice, `#/system${at && `?at=${at}`}`);
  for (const one of [...status.modbus.closed, ...(status.modbus.other_framing || [])]) add('bad', `Modbus ${one.listener}`, one.advice);
  for (const one of status.modbus.masters) add('warn', `Master on ${one.port}`, one.advice, '#/system?at=masters');
  for (const one of status.modbus.routes) add('warn', `Route ${one.units} to ${one.target}`, one.advice, '#/system?at=routes');
  return list;
}

const routeOf = (alarm, status) => status.modbus.routes.find((route) => route.target === `server ${alarm.device}`
  || (alarm.name === 'no answer to clients' && route.by_unit.some((unit) => `unit-${unit.unit}` === alarm.device)));

/** The problem that an alarm belongs to; undefined: the alarm is a problem of its own. */
function ownerOf(alarm, list, status, away) {
  const find = (key) => list.find((one) => one.key === key);
  const name = `${alarm.line}.${alarm.device}`;
  if (['port down', 'ring open'].includes(alarm.name)) return find(`line ${alarm.line}`);
  if (['no answer', 'wrong device', 'another device'].includes(alarm.name)) {
    return find(`device ${name}`) || (away.has(name) ? find(`line ${alarm.line}`) : undefined);
  }
  const route = routeOf(alarm, status);
  if (route) return find(`part Route ${route.units} to ${route.target}`);
  const its = find(`device ${name}`);
  const words = its ? [its.cause, ...its.more].join(' ').split(/\W+/) : [];
  return alarm.point && words.includes(alarm.point) ? its : undefined;
}

/** Returns the rank of a problem, 0 for the worst. A problem that is over ranks behind all present ones, but before hints. */
function score(one) {
  if (one.over) return priorities.length * 2 - 3 + priorities.indexOf(one.priority) / 10;
  const places = one.alarms.map((alarm) => priorities.indexOf(alarm.priority) * 2 + (unseen(alarm) ? 0 : 1));
  return Math.min(...(places.length ? places : [priorities.indexOf(one.priority) * 2]));
}

/** Returns the problems, worst first, those of one rank newest first. */
export function problemsOf(status, alarms) {
  const list = [];
  const away = new Set();
  for (const line of status.lines) {
    const shared = lineProblems(line);
    list.push(...shared.list);
    for (const name of shared.away) away.add(`${line.name}.${name}`);
    for (const device of line.devices) {
      if (inMaintenance(device, line) || shared.away.includes(device.name)) continue;
      const one = deviceProblem(line, device);
      if (one) list.push(one);
    }
  }
  list.push(...gatewayProblems(status));
  for (const alarm of alarms) {
    let owner = ownerOf(alarm, list, status, away);
    if (!owner) {
      const kind = alarm.state === 'returned' ? 'info' : 'bad';
      owner = problem(`alarm ${alarm.seq}`, kind, alarmSource(alarm), sourceLink(alarm, status), '', null, []);
      owner.cause = alarm.text;
      list.push(owner);
    }
    owner.alarms.push(alarm);
  }
  for (const one of list) {
    one.alarms.sort((a, b) => priorities.indexOf(a.priority) - priorities.indexOf(b.priority) || unseen(b) - unseen(a));
    const [first] = one.alarms;
    one.priority = first?.priority || ofKind[one.kind];
    if (first) {
      one.since ??= Date.parse(first.raised);
      one.over = one.alarms.every((alarm) => alarm.state === 'returned');
    }
    one.waiting = one.alarms.filter(unseen).map((alarm) => alarm.seq);
    one.score = score(one);
  }
  return list.sort((a, b) => a.score - b.score || (b.since || 0) - (a.since || 0));
}

/** Returns the lines and devices in maintenance, which are no failures: [{key, subject, href, text, line?, device?}]. */
export function maintenanceOf(status) {
  return status.lines.flatMap((line) => (line.port_state === 'released'
    ? [{key: line.name, subject: `Line ${line.name}`, href: lineLink(line.name), line: line.name, until: time(line.released_until),
      text: `its port is lent${line.devices.length ? `, with ${plural(line.devices.length, 'device')}` : ''}`}]
    : line.devices.filter((d) => inMaintenance(d, line)).map((d) => ({key: `${line.name}.${d.name}`, subject: `${line.name}.${d.name}`,
      href: deviceLink({line: line.name, device: d.name}), device: `${line.name}.${d.name}`, text: disabledText(d) || d.advice[0] || 'disabled'}))));
}
