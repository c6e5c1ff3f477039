// SPDX-License-Identifier: Apache-2.0
// Computes the use of a line's wire from two statuses up to a minute apart. With less than five seconds of statuses, it
// is the use since the start.
const windowMs = 60000;

export class WireUse {
  constructor() {
    this.past = [];
    this.span = 'since the start';
  }

  take(line, uptime) {
    const sample = {uptime, busy: line.busy_ms, devices: new Map(line.devices.map((d) => [d.name, d.busy_ms]))};
    if (this.past.length && this.past.at(-1).uptime >= uptime) this.past = [];
    this.past.push(sample);
    while (this.past.length > 2 && this.past[1].uptime <= uptime - windowMs) this.past.shift();
    const first = this.past[0];
    const enough = uptime - first.uptime >= 5000;
    const from = enough ? first : {uptime: 0, busy: 0, devices: new Map()};
    const elapsed = uptime - from.uptime || 1;
    this.span = enough ? `last ${Math.round(elapsed / 1000)} s` : 'since the start';
    const rows = line.devices.map((d) => ({name: d.name, share: (d.busy_ms - (from.devices.get(d.name) || 0)) / elapsed}));
    const ofDevices = rows.reduce((sum, row) => sum + row.share, 0);
    const busy = Math.max(ofDevices, (line.busy_ms - from.busy) / elapsed);
    rows.sort((a, b) => b.share - a.share);
    rows.push({name: 'routes, and waiting after exchanges', share: busy - ofDevices});
    rows.push({name: 'idle', share: Math.max(0, 1 - busy)});
    return rows;
  }
}

const kinds = [
  ['polls', 'polls'],
  ['probes', 'probes'],
  ['routes', 'requests of clients'],
  ['writes', 'writes, with their read-backs'],
  ['silence', 'exchanges without a reply'],
  ['drains', 'waiting for silence after exchanges'],
];

/** The use of the last whole minute; without numbers until there is one. */
export function minuteOf(line, uptime) {
  const known = uptime >= windowMs;
  const rows = kinds.map(([key, name]) => ({name, share: known ? line.minute[key] : null}));
  const idle = 1 - rows.reduce((sum, row) => sum + row.share, 0);
  return [...rows, {name: 'idle', share: known ? Math.max(0, idle) : null}];
}
