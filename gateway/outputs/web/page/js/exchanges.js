// SPDX-License-Identifier: Apache-2.0
// Turns the frames of a trace into whole exchanges: one request, its reply, their meaning and the outcome.

import {inWords} from './format.js';
import {offset, zoneName} from './zone.js';

const form = /^(\S+) (\S+) ([<>=])\s?(.*)$/;

const bytesOf = (hex) => hex.split(' ').filter(Boolean);
const codesOf = (bytes) => bytes.map((b) => (b === '**' ? 42 : parseInt(b, 16)));
const isText = (code) => code >= 32 && code < 127;

/** Returns the meaning that follows a frame's bytes; empty if the text only repeats the bytes as characters. */
function meaningOf(hex, text) {
  const codes = codesOf(bytesOf(hex));
  const same = codes.every((code, i) => (text[i] ?? '.') === (isText(code) ? String.fromCharCode(code) : '.'));
  return same && text.length <= codes.length ? '' : text;
}

/** Returns the bytes as text if every byte is printable, CR or LF, else in hex. */
function shown(hex) {
  const bytes = bytesOf(hex);
  const codes = codesOf(bytes);
  if (!codes.every((c) => isText(c) || c === 10 || c === 13)) return bytes.join(' ');
  return codes.map((c) => (c === 13 ? '\\r' : c === 10 ? '\\n' : String.fromCharCode(c))).join('');
}

/** take(record) receives the frames one by one, and returns an exchange when one has ended, else null. */
export class ExchangeReader {
  constructor() {
    this.open = new Map();
    this.count = 0;
  }

  take(record) {
    const parts = form.exec(record);
    if (!parts) {
      const [time, ...rest] = record.split(' ');
      return {key: `${record} ${++this.count}`, time, device: '', request: rest.join(' '), reply: '', meaning: '', outcome: 'note'};
    }
    const [, time, device, sign, rest] = parts;
    const bar = rest.indexOf(' | ');
    const hex = bar < 0 ? rest : rest.slice(0, bar);
    if (sign === '>') {
      this.open.set(device, {key: `${time} ${device}`, time, device, sent: hex, received: '', meaning: ''});
      return null;
    }
    const exchange = this.open.get(device) || {key: `${time} ${device}`, time, device, sent: '', received: '', meaning: ''};
    if (sign === '<') {
      exchange.received += ` ${hex}`;
      if (bar >= 0) exchange.meaning ||= meaningOf(hex, rest.slice(bar + 3));
      this.open.set(device, exchange);
      return null;
    }
    this.open.delete(device);
    return {...exchange, request: shown(exchange.sent), reply: shown(exchange.received), outcome: rest};
  }
}

/** Returns the exchanges in a line's records. If the records begin inside an exchange, that exchange is left out. */
export function exchangesOf(records) {
  const reader = new ExchangeReader();
  const first = form.exec(records[0] || '')?.[3] === '<' ? records.findIndex((r) => form.exec(r)?.[3] === '=') + 1 : 0;
  return records.slice(first).map((record) => reader.take(record)).filter(Boolean);
}

/** Writes the time of a trace, "07:13:43.598246" in UTC, in the shown zone. */
function shownClock(time) {
  const day = 24 * 60;
  const minutes = Number(time.slice(0, 2)) * 60 + Number(time.slice(3, 5)) + Math.round(offset(Date.now()) / 60e3);
  const shown = ((minutes % day) + day) % day;
  return Number.isNaN(shown) ? time : `${String(Math.floor(shown / 60)).padStart(2, '0')}:${String(shown % 60).padStart(2, '0')}${time.slice(5)}`;
}

export function exchangeColumns(withDevice) {
  return [
    {title: `Time (${zoneName()})`, class: 'time', text: (e) => shownClock(e.time)},
    ...(withDevice ? [{title: 'Device', class: 'name', text: (e) => e.device}] : []),
    {title: 'Request', class: 'code', text: (e) => e.request},
    {title: 'Reply', class: 'code', text: (e) => e.reply || '–'},
    {title: 'Meaning', class: 'means', text: (e) => e.meaning},
    {title: 'Outcome', class: 'outcome', text: (e) => inWords(e.outcome)},
  ];
}
