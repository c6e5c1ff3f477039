// SPDX-License-Identifier: Apache-2.0
// The page's store of points: descriptions, fetched when a view needs them, and values from the stream.
import {get} from './api.js';
import {emit, on} from './bus.js';
import {now} from './clock.js';
import {qualityKind, valueText} from './format.js';

/** id → {value, shown, quality, text, at}: `at` is the gateway's time of the reading in milliseconds, or null. */
const values = new Map();
let described = null;  // promise of all points
let dirty = new Set();
let asked = false;
let generation = null;

function keep(id, value, quality, text, at, shown) {
  const known = values.get(id);
  if (known) {
    known.value = value;
    known.quality = quality;
    known.text = text;
    known.at = at;
    known.shown = shown;
  } else {
    values.set(id, {value, quality, text, at, shown});
  }
}

function tellSoon() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    const ids = dirty;
    dirty = new Set();
    emit('values', ids);
  });
}

/** Stores the values of a snapshot (`whole`) or of a change from the stream. */
export function take(data, whole) {
  if (whole) {
    if (generation !== null && generation !== data.generation) forget();
    generation = data.generation;
    values.clear();
  }
  for (const [id, value, quality, text, at, shown] of data.values) {
    keep(id, value, quality, text, at, shown);
    dirty.add(id);
  }
  tellSoon();
}

export const valueOf = (id) => values.get(id);

/** The text of a value, as the gateway shows it; empty: there is none. */
export const shownOf = ({value, shown}) => shown ?? (value === null ? '' : valueText(value));

/** good, uncertain or bad; none: the point can only be written. */
export const kindOf = (point, live) => (point.write_only ? 'none' : qualityKind(live?.quality ?? 0));

/** True if a value is bad because its device is in maintenance, which is no failure. */
export const resting = (live) => (live.quality & 0xff) === 28;

export const writable = (point) => point.access === 'write' || point.access === 'read_write';

/** The limit that a good value has passed, if any. */
export function beyond(point, live) {
  if (typeof live.value !== 'number' || kindOf(point, live) !== 'good') return null;
  return limitsOf(point).find(({side, value}) => (side === 'above' || side === 'max' ? live.value > value : live.value < value)) || null;
}

function adopt(answer) {
  for (const point of answer.points) {
    point.name = `${point.line}.${point.device}.${point.point}`;
    point.haystack = `${point.name} ${point.description || ''}`.toLowerCase();
    if (!values.has(point.id)) {
      const at = point.age_ms === null ? null : now() - point.age_ms;
      keep(point.id, point.value, point.quality, point.quality_text, at, point.shown);
    }
  }
  return answer.points;
}

/** Lets the browser paint between two long calculations. */
const breath = (result) => new Promise((resolve) => setTimeout(resolve, 0, result));

/** Returns all points of the gateway with their descriptions; fetched once, and again after a reload. */
export function allPoints() {
  if (!described) {
    const mine = get('points').then(breath).then(adopt).then(breath);
    described = mine;
    mine.catch(() => {
      if (described === mine) described = null;
    });
  }
  return described;
}

/** The limits of a point and the thresholds of its events: [{value, text}]. */
export const limitsOf = (point) => (!point ? [] : [
  ...(point.events || []).map(({on: side, value, alarm}) => ({value, side, alarm,
    text: `${side} ${value}${alarm && alarm !== 'off' ? ` (${alarm} alarm)` : ''}`})),
  ...['min', 'max'].filter((key) => typeof point[key] === 'number').map((key) => ({value: point[key], side: key, text: `${key} ${point[key]}`})),
]);

/** How a passed limit is written beside a quality. */
export const beyondText = (passed) => (passed ? `, ${{min: 'below', max: 'above'}[passed.side] || passed.side} ${passed.value}` : '');

const mostDevices = 12;

/** Returns the descriptions of points by their names. A few devices are a smaller request than all points. */
export async function describe(names) {
  const devices = [...new Set(names.map((name) => name.split('.').slice(0, 2).join('.')))];
  const found = devices.length > mostDevices ? await allPoints()
    : (await Promise.all(devices.map((device) => pointsOf(device).catch(() => [])))).flat();
  return new Map(found.map((point) => [point.name, point]));
}

export const pointsOf = (device) => get('points', {device}).then(adopt);

export const wordsOf = (text) => text.toLowerCase().split(/\s+/).filter(Boolean);

/** Returns the points whose name or description contains every word of the text. */
export function matching(points, text) {
  const words = wordsOf(text);
  if (!words.length) return points;
  return points.filter((point) => words.every((word) => point.haystack.includes(word)));
}

function forget() {
  described = null;
  values.clear();
  emit('points');
}

on('reload', forget);
on('link', ({state, before}) => {
  // While the connection was lost, the gateway may have been replaced or have got a new configuration.
  if (state === 'live' && before === 'lost') {
    described = null;
    emit('points');
  }
});
