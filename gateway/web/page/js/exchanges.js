// SPDX-License-Identifier: Apache-2.0
// Turns the records of a trace into whole exchanges: one request, its reply and its outcome.

const form = /^(\S+) (\S+) ([<>=])\s?(.*)$/;

/** Text where every byte is one, else the bytes in hex. */
function shown(hex) {
  const bytes = hex.split(' ').filter(Boolean);
  const codes = bytes.map((b) => (b === '**' ? 42 : parseInt(b, 16)));
  if (!codes.every((c) => (c >= 32 && c < 127) || c === 10 || c === 13)) return bytes.join(' ');
  return codes.map((c) => (c === 13 ? '\\r' : c === 10 ? '\\n' : String.fromCharCode(c))).join('');
}

/** Takes records one by one and gives back an exchange when one has ended. */
export class ExchangeReader {
  constructor() {
    this.open = new Map();
    this.count = 0;
  }

  take(record) {
    const parts = form.exec(record);
    if (!parts) {
      const [time, ...rest] = record.split(' ');
      return {key: `${record} ${++this.count}`, time, device: '', request: rest.join(' '), reply: '', outcome: 'note'};
    }
    const [, time, device, sign, rest] = parts;
    const hex = rest.split(' | ')[0];
    if (sign === '>') {
      this.open.set(device, {key: `${time} ${device}`, time, device, sent: hex, received: ''});
      return null;
    }
    const exchange = this.open.get(device) || {key: `${time} ${device}`, time, device, sent: '', received: ''};
    if (sign === '<') {
      exchange.received += ` ${hex}`;
      this.open.set(device, exchange);
      return null;
    }
    this.open.delete(device);
    return {...exchange, request: shown(exchange.sent), reply: shown(exchange.received), outcome: rest};
  }
}

/** The exchanges of a recorder; it may begin in the midst of one, which is left out. */
export function exchangesOf(records) {
  const reader = new ExchangeReader();
  const first = form.exec(records[0] || '')?.[3] === '<' ? records.findIndex((r) => form.exec(r)?.[3] === '=') + 1 : 0;
  return records.slice(first).map((record) => reader.take(record)).filter(Boolean);
}

export function exchangeColumns(withDevice) {
  return [
    {title: 'Time', class: 'time', text: (e) => e.time},
    ...(withDevice ? [{title: 'Device', class: 'name', text: (e) => e.device}] : []),
    {title: 'Request', class: 'code', text: (e) => e.request},
    {title: 'Reply', class: 'code', text: (e) => e.reply || '–'},
    {title: 'Outcome', class: 'outcome', text: (e) => e.outcome},
  ];
}
