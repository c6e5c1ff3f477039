// SPDX-License-Identifier: Apache-2.0
// Small curves of the last hour. Their values are requested one after the other, the latest wish first.
import {svg} from './dom.js';
import {now} from './clock.js';
import {fetchSeries} from './series.js';

const hour = 3600e3;
const freshMs = 120e3;
const steps = 60;
const mostAtOnce = 3;

const known = new Map();  // name → {at, rows, from, until}
let wishes = [];
let running = 0;

async function work() {
  const wish = wishes.pop();
  if (!wish) return;
  if (!wish.wanted()) return work();
  ++running;
  const until = now();
  const found = await fetchSeries(wish.name, until - hour, until, steps).catch(() => ({rows: []}));
  --running;
  const result = {at: Date.now(), rows: found.rows, from: until - hour, until, step: found.step_ms};
  known.set(wish.name, result);
  if (wish.wanted()) wish.use(result);
  work();
}

/** Calls use({rows, from, until, step}) with the last hour of a point, at once if it is known, unless wanted() is false. */
export function lastHour(name, use, wanted) {
  const old = known.get(name);
  if (old) use(old);
  if (old && Date.now() - old.at < freshMs) return;
  wishes = wishes.filter((wish) => wish.name !== name);
  wishes.push({name, use, wanted});
  if (running < mostAtOnce) work();
}

export class Spark {
  constructor() {
    this.line = svg('path');
    this.limits = svg('path', {class: 'limit'});
    this.element = svg('svg', {'viewBox': '0 0 100 24', 'preserveAspectRatio': 'none', 'aria-hidden': 'true', class: 'spark'},
        this.limits, this.line);
  }

  clear() {
    this.line.removeAttribute('d');
    this.limits.removeAttribute('d');
  }

  paint({rows, from, until, step}, limits) {
    const values = rows.filter((row) => row[2] !== null);
    if (!values.length) return this.clear();
    let low = Math.min(...values.map((row) => row[1]));
    let high = Math.max(...values.map((row) => row[3]));
    const span = high - low || Math.abs(high) * 0.02 || 1;
    const near = limits.filter(({value}) => value > low - span && value < high + span);
    for (const {value} of near) [low, high] = [Math.min(low, value), Math.max(high, value)];
    const y = (value) => (high === low ? 12 : 22 - (value - low) / (high - low) * 20).toFixed(1);
    let before = -Infinity;
    this.line.setAttribute('d', values.map(([t, , mean]) => {
      const first = t - before > 1.5 * step;
      before = t;
      return `${first ? 'M' : 'L'}${((t - from) / (until - from) * 100).toFixed(1)} ${y(mean)}${first ? 'h.1' : ''}`;
    }).join(''));
    this.limits.setAttribute('d', near.map(({value}) => `M0 ${y(value)}H100`).join(''));
  }
}
