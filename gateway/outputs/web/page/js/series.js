// SPDX-License-Identifier: Apache-2.0
// Past values: fetches and summarises them.
import {address, get} from './api.js';
import {pointText} from './format.js';
import {recordedSeries} from './recorder.js';
import {session} from './session.js';

/** Returns {point, unit, step_ms, rows: [[t, min, mean, max, good share], …]}. */
export function fetchSeries(point, since, until, pixels) {
  if (!session.history) return recordedSeries(point, since, until);
  return get('history', {point, since_ms: Math.round(since), until_ms: Math.round(until), pixels});
}

export const csvLink = (points, since, until) =>
  address('history.csv', {point: points.join(), since_ms: Math.round(since), until_ms: Math.round(until)});

/** If the good share of a step is smaller, the value was not always good. The difference to 1 allows for rounding. */
const wholeShare = 0.995;

/** Returns the spans [from, until] in which a value was not always good. A step that ends after `end` is not counted. */
export function doubtful(series, end) {
  const spans = [];
  let open = null;
  for (const [t, , , , good] of series.rows) {
    if (good < wholeShare && t + series.step_ms <= end) {
      if (open && t - open[1] <= series.step_ms) open[1] = t + series.step_ms;
      else spans.push(open = [t, t + series.step_ms]);
    } else {
      open = null;
    }
  }
  return spans;
}

export function summary(series) {
  let min = Infinity;
  let max = -Infinity;
  let sum = 0;
  let n = 0;
  for (const [, low, mean, high] of series.rows) {
    if (mean === null) continue;
    min = Math.min(min, low);
    max = Math.max(max, high);
    sum += mean;
    ++n;
  }
  return n ? {min, max, mean: sum / n, last: series.rows.at(-1)[2]} : null;
}

/** Returns the row of a series that applies at `time`, or null: the latest row before `time`, unless it is too old. */
export function rowAt(series, time) {
  const {rows} = series;
  let low = 0;
  let high = rows.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] <= time) low = middle + 1;
    else high = middle;
  }
  const row = rows[low - 1];
  return row && time - row[0] <= 1.5 * series.step_ms ? row : null;
}

/** The value in a step of a chart. A mean of values with texts has no meaning: the step has its smallest and greatest value. */
export function spread(point, [, min, mean, max]) {
  if (min === max) return pointText(point, mean);
  const ends = `${pointText(point, min)} … ${pointText(point, max)}`;
  return point?.states ? ends : `${pointText(point, mean)} (${ends})`;
}
