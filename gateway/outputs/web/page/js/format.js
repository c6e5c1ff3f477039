// SPDX-License-Identifier: Apache-2.0
// How the page writes numbers, times, qualities and states.
import {shownTime} from './zone.js';

const grouped = new Intl.NumberFormat('en');

export const count = (n) => grouped.format(n);
export const plural = (n, one, many = `${one}s`) => `${count(n)} ${n === 1 ? one : many}`;

export function ageText(ms) {
  const s = Math.max(0, ms) / 1000;
  if (s < 120) return `${Math.floor(s)} s`;
  if (s < 7200) return `${Math.floor(s / 60)} min`;
  if (s < 172800) return `${Math.floor(s / 3600)} h`;
  return `${Math.floor(s / 86400)} d`;
}

/** Makes "a, b and c" of names, and of many names the first ones and their number. */
export function listed(names, most = 4) {
  const some = names.length > most ? [...names.slice(0, most - 1), `${names.length - most + 1} more`] : names;
  return some.length < 2 ? some.join() : `${some.slice(0, -1).join(', ')} and ${some.at(-1)}`;
}

const identifiers = new RegExp('\\b(no|line|not|never)_(reply|down|sent|seen)\\b', 'g');

const isoTimes = /\b\d{4}-\d\d-\d\dT[\d:.]+Z/g;

/** Makes words of the gateway's identifiers of outcomes ("no reply" of "no_reply"), and shown times of its times. */
export const inWords = (text) => (text || '').replace(identifiers, '$1 $2').replace(isoTimes, (time) => civilSeconds(time));

export function percent(share) {
  if (share === null || share === undefined || Number.isNaN(share)) return '–';
  if (share === 1 || share === 0) return `${share * 100} %`;
  // Limited to 99.9, because 99.97 % must not be rounded up to 100 %.
  return `${Math.min(99.9, share * 100).toFixed(1)} %`;
}

export function micros(us) {
  if (!us) return '–';
  if (us < 10000) return `${(us / 1000).toFixed(1)} ms`;
  return us < 1e6 ? `${Math.round(us / 1000)} ms` : `${(us / 1e6).toFixed(1)} s`;
}

/** Makes "Queue full" from "queue full", and "OK" from "ok". */
const titled = (label) => (label.length < 3 ? label.toUpperCase() : label[0].toUpperCase() + label.slice(1));

/** Turns the counters that the gateway names, {key: label}, into [title, text(of)]. */
export const named = (labels) => Object.entries(labels).map(([key, label]) =>
  [titled(label), (of) => (key.endsWith('_us') ? micros : count)(of[key])]);

export function bytes(n) {
  if (n < 1000) return `${n} B`;
  if (n < 1e6) return `${(n / 1000).toFixed(1)} kB`;
  return n < 1e9 ? `${(n / 1e6).toFixed(1)} MB` : `${(n / 1e9).toFixed(2)} GB`;
}

/** Writes a time, given as the gateway writes it or in milliseconds, in the shown zone: "2026-11-27 01:12:09.908". */
export function civil(time) {
  const ms = typeof time === 'number' ? time : Date.parse(time || '');
  return Number.isNaN(ms) ? '–' : shownTime(ms).replace('T', ' ');
}

export const civilSeconds = (time) => civil(time).replace(/\.\d+$/, '');

export function valueText(value) {
  if (value === null || value === undefined) return '–';
  if (typeof value === 'number' && !Number.isInteger(value)) return String(Number(value.toPrecision(7)));
  return String(value);
}

/** A number of a chart with six significant digits. */
export const rounded = (value) => (value === undefined || value === null ? '–' : String(Number(value.toPrecision(6))));

/** A number of a point, as the gateway would show it: with its texts and decimals. `point` is undefined: not known. */
export function pointText(point, value) {
  if (value === undefined || value === null) return '–';
  if (point?.states) return point.states[Number(value)] ?? String(value);
  if (typeof value !== 'number') return String(value);
  return point?.precision !== undefined ? value.toFixed(point.precision) : rounded(value);
}

/** A client as the gateway names it, for people: "anna at 10.0.0.7" of "web:anna@10.0.0.7". */
export function who(client) {
  const [, user, at] = /^web:(?:(.*)@)?(.*)$/.exec(client) || [];
  return at ? (user ? `${user} at ${at}` : at) : client.replace(/^user:/, '');
}

/** Returns good, uncertain or bad for a quality word (docs/modbus.md). */
export function qualityKind(quality) {
  const low = quality & 0xc0;
  return low === 0xc0 ? 'good' : low === 0x40 ? 'uncertain' : 'bad';
}

export const qualityMark = {good: 'fine', uncertain: 'warn', bad: 'bad', none: 'off'};

const deviceStates = {
  offline: ['bad', 0],
  degraded: ['warn', 2],
  'never seen': ['new', 1],
  disabled: ['off', 4],
  online: ['fine', 5],
};

/** The shape of a device's state, and its rank among troubles: the smaller, the worse. */
export function deviceTrouble(device) {
  const [shape, rank] = device.maintenance ? deviceStates.disabled : deviceStates[device.state] || ['info', 3];
  const marred = rank === 5 && (device.advice.length > 0 || device.trouble !== '');
  return {shape: marred ? 'info' : shape, rank: marred ? 3 : rank};
}

export function lineTrouble(line) {
  if (line.port_state === 'closed' || line.stuck_since) return {shape: 'bad', rank: 0};
  if (line.port_state === 'released') return {shape: 'off', rank: 2};
  if (line.echo_lost_since) return {shape: 'warn', rank: 1};
  return line.advice.length ? {shape: 'info', rank: 3} : {shape: 'fine', rank: 4};
}

export function lineState(line) {
  if (line.stuck_since) return 'stuck';
  if (line.port_state === 'released') return 'in maintenance: port lent';
  return `port ${line.port_state}${line.echo_lost_since ? ', no echo' : ''}`;
}

/**
 * The gateway's advice about a device; about its line instead, while the port is not open and there is none for the device.
 */
export const deviceAdvice = (line, device) =>
  (device.advice.length || line.port_state === 'open' ? device.advice : line.advice);

/** The state of a device in words; a device in maintenance is no failure. */
export const stateWord = (device) => device.state_text || device.state;

/** A share of the last minute; a dash until there is a whole minute, and where a line only listens. */
export function shareText(line, share, uptime) {
  const listens = line.devices.length > 0 && line.devices.every((device) => device.unasked);
  return uptime < 60e3 || listens ? '–' : `${Math.round(share * 100)} %`;
}

/** The share of the last hour in which a device answered; a dash if it was not polled. */
export const hourShare = ({answered, failed, availability}) => (answered + failed ? percent(availability) : '–');

/** The share of good exchanges; null without exchanges, and for a device that only sends: it has no failed ones to compare. */
export const okShare = (device) => (device.exchanges && !device.unasked ? device.outcomes.ok / device.exchanges : null);
