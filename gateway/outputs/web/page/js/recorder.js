// SPDX-License-Identifier: Apache-2.0
// If the gateway records no history, the page records the chosen points itself while it is open.
import {link} from './stream.js';
import {qualityKind} from './format.js';
import {now} from './clock.js';
import * as picked from './picked.js';
import {allPoints, valueOf} from './store.js';

const periodMs = 1000;
const most = 36000;

const kept = new Map();  // name → rows
let ids = new Map();

async function sample() {
  const names = picked.list();
  if (document.hidden || link.state !== 'live' || !names.length) return;
  const points = await allPoints().catch(() => []);
  ids = new Map(points.filter((p) => names.includes(p.name)).map((p) => [p.name, p]));
  const t = Math.round(now() / periodMs) * periodMs;
  for (const [name, point] of ids) {
    const live = valueOf(point.id);
    const value = live ? Number(live.value) : NaN;
    if (!live || live.value === null || Number.isNaN(value) || qualityKind(live.quality) === 'bad') continue;
    if (!kept.has(name)) kept.set(name, []);
    const rows = kept.get(name);
    if (rows.length && rows.at(-1)[0] >= t) continue;
    rows.push([t, value, value, value, qualityKind(live.quality) === 'good' ? 1 : 0]);
    if (rows.length > most) rows.shift();
  }
}

export function startRecorder() {
  setInterval(sample, periodMs);
}

export async function recordedSeries(point, since, until) {
  const rows = (kept.get(point) || []).filter(([t]) => t >= since && t <= until);
  // A browser's timer may be late by one period, so only a longer gap is a hole.
  return {point, unit: ids.get(point)?.unit || '', step_ms: 2 * periodMs, rows};
}
