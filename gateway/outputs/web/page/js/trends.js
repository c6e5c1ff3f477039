// SPDX-License-Identifier: Apache-2.0
// The view of trends: up to eight points over fifteen minutes to a year.
import {get} from './api.js';
import {on} from './bus.js';
import {now} from './clock.js';
import {h, setText} from './dom.js';
import {ageText, civilSeconds} from './format.js';
import {push, replace, trendsLink} from './links.js';
import {recall, remember} from './memory.js';
import {Headline, Problem, select} from './parts.js';
import * as picked from './picked.js';
import {Plot} from './plot.js';
import {pointPicker} from './point_picker.js';
import {csvLink, fetchSeries} from './series.js';
import {session} from './session.js';
import {repeat} from './status.js';
import {describe, limitsOf} from './store.js';
import {sample, trendTable} from './trend_table.js';
import {calendar, momentOf, shownTime, zoneName} from './zone.js';

const minute = 60e3;
const hour = 60 * minute;
const ranges = {'15m': ['15 min', 15 * minute], '1h': ['1 h', hour], '6h': ['6 h', 6 * hour], '24h': ['1 day', 24 * hour],
  '7d': ['1 week', 168 * hour], '30d': ['30 days', 720 * hour], '365d': ['1 year', 8760 * hour]};
const mostPixels = 1200;
const shortest = 10e3;
const longest = 20 * 365 * 24 * hour;
const lowest = 230;
const mostPages = 5;
const marksPeriod = 15e3;
const kinds = {high: 'bad', medium: 'warn', low: 'info'};

/** The time that the charts show: the last `length` milliseconds up to now, or up to `end`. */
class Span {
  constructor({range, from, until}) {
    const fixed = Number(from) < Number(until);
    this.end = fixed ? Number(until) : null;
    this.length = fixed ? until - from : ranges[range]?.[1] || Number(range) || hour;
  }

  now() {
    const end = this.end ?? now();
    return [end - this.length, end];
  }

  parameters() {
    const [from, until] = this.now();
    if (this.end !== null) return {from: Math.round(from), until: Math.round(until)};
    return {range: Object.keys(ranges).find((key) => ranges[key][1] === this.length) || Math.round(this.length)};
  }

  follow(length) {
    this.length = Math.min(longest, Math.max(shortest, length));
    this.end = null;
  }

  /** If the span ends at the present time, it moves with the time. */
  fix(from, until) {
    const end = Math.min(until, now());
    const length = Math.min(longest, Math.max(shortest, end - from));
    if (end >= now() - length / 100) return this.follow(length);
    this.length = length;
    this.end = end;
  }

  move(part) {
    const [from, until] = this.now();
    this.fix(from + part * this.length, until + part * this.length);
  }

  /** While the span follows the time its right end stays, else its middle. */
  zoom(scale) {
    if (this.end === null) return this.follow(this.length * scale);
    const [from, until] = this.now();
    const more = (scale - 1) * this.length / 2;
    this.fix(from - more, until + more);
  }
}

const deviceOf = (point) => point.split('.').slice(0, 2).join('.');
const devicesOf = (names) => [...new Set(names.map(deviceOf))];

/** The events that an alarm is acknowledged, is over with its configuration, or has another priority. */
const aboutAlarms = [1000016, 1000017, 1000024];

/** The events of a device, as marks of a chart. The mark of an event that has raised an alarm has the alarm's priority. */
async function fetchMarks(device, from, until) {
  const records = [];
  for (let after = 0, pages = 0; pages < mostPages; ++pages) {
    const page = await get('events', {target: device, after, since_ms: Math.round(from)});
    records.push(...page.records);
    if (!page.more) break;
    after = page.next;
  }
  return records.map((event) => ({device, time: Date.parse(event.device_time), kind: (event.state !== 'off'
    && !aboutAlarms.includes(event.code) && kinds[event.priority]) || 'event', text: event.text})).filter(({time}) => time >= from && time <= until);
}

/** Named sets of points, stored in this browser; the address has the name as well, so a link shows the same. */
function setsPart(name, given) {
  const field = h('input', {type: 'text', id: 'set-name', placeholder: 'Name of this set', maxlength: '60', value: given});
  const list = () => recall('sets', {});
  const chosen = select('Set', [], '', (key) => key && name(key, list()[key]));
  const options = chosen.querySelector('select');
  const paint = (current) => {
    const names = Object.keys(list()).sort();
    options.replaceChildren(...['', ...names].map((key) => h('option', {value: key, selected: key === current}, key || '–')));
    chosen.hidden = !names.length;
    drop.hidden = !names.includes(current);
  };
  const keep = (event) => {
    event.preventDefault();
    const key = field.value.trim();
    if (!key) return field.focus();
    remember('sets', {...list(), [key]: picked.list()});
    name(key, null);
  };
  const drop = h('button', {type: 'button', onclick: () => {
    const {[options.value]: gone, ...rest} = list();
    remember('sets', rest);
    name('', null);
  }}, 'Delete this set');
  const element = h('div', {class: 'controls'}, chosen, h('form', {class: 'group-form', onsubmit: keep},
      h('label', {for: 'set-name', class: 'hidden'}, 'Name of this set'), field, h('button', {type: 'submit'}, 'Keep as a set')), drop);
  paint(given);
  return {element, paint};
}

export function trends(root, _, given) {
  let span = new Span(given);
  let set = given.set || '';
  let single = given.panels === 'curve';
  let list = [];
  let described = new Map();
  let marks = [];
  let marksAt = 0;
  let round = 0;
  let drawn = 0;
  let end = () => {};
  if (given.points) picked.set(given.points.split(',').filter(Boolean));

  const headline = new Headline('Trends');
  const problem = new Problem();
  const about = h('span', {class: 'about', role: 'status'});
  const charts = h('div', {class: 'plots'});
  const table = trendTable();
  const plots = new Map();
  const group = (label, ...buttons) => h('div', {class: 'group', role: 'group', 'aria-label': label}, buttons);
  const button = (text, change, label) => h('button', {type: 'button', 'aria-label': label, onclick: () => go(change)}, text);
  const presets = Object.entries(ranges).map(([key, [text, length]]) => {
    const one = button(text, () => span.follow(length), `Last ${text}`);
    one.dataset.range = key;
    return one;
  });
  const from = h('input', {type: 'datetime-local', step: '1', id: 'from', required: true});
  const until = h('input', {type: 'datetime-local', step: '1', id: 'until', required: true});
  const dayButton = (text, days) => h('button', {type: 'button', onclick: () => {
    picker.open = false;
    go(() => span.fix(calendar(now(), {days}), calendar(now(), {days: days + 1})));
  }}, text);
  const picker = h('details', {class: 'menu', ontoggle: () => picker.open && fillPicker()}, h('summary', {}, 'From … to'),
      h('form', {onsubmit: pickTime}, h('label', {for: 'from'}, `From (${zoneName()})`), from,
          h('label', {for: 'until'}, `To (${zoneName()})`), until, h('p', {class: 'buttons'}, dayButton('Today', 0), dayButton('Yesterday', -1), h('button', {type: 'submit', class: 'strong'}, 'Show'))));
  const byCurve = h('input', {type: 'checkbox', checked: single, onchange: () => {
    single = byCurve.checked;
    address(replace);
    paint();
  }});
  const withMarks = h('input', {type: 'checkbox', checked: recall('marks', true), onchange: () => {
    remember('marks', withMarks.checked);
    marksAt = 0;
    refresh();
  }});
  const adding = pointPicker();
  const csv = h('a', {class: 'button', download: ''}, 'CSV of all curves');
  const sets = setsPart((key, points) => {
    set = key;
    if (points) picked.set(points);
    address(push);
    sets.paint(set);
  }, set);
  root.append(headline.element,
      h('div', {class: 'controls no-print'}, group('Time shown', presets), group('Move and zoom',
          button('◀', () => span.move(-0.5), 'Earlier'), button('▶', () => span.move(0.5), 'Later'),
          button('+', () => span.zoom(0.5), 'Zoom in'), button('−', () => span.zoom(2), 'Zoom out')), picker, about),
      problem.element, charts,
      h('div', {class: 'controls no-print'}, h('label', {class: 'check'}, byCurve, 'A panel for each curve'),
          h('label', {class: 'check', hidden: !session.events}, withMarks, 'Events and alarms'), csv),
      table.element, adding.element, sets.element);

  const address = (write) => write(trendsLink({set, points: picked.list().join(','), ...span.parameters(), panels: single && 'curve'}));

  function go(change) {
    change();
    address(push);
    refresh();
  }

  function fillPicker() {
    const [begin, stop] = span.now();
    from.value = shownTime(Math.round(begin)).slice(0, 19);
    until.value = shownTime(Math.round(stop)).slice(0, 19);
  }

  function pickTime(event) {
    event.preventDefault();
    const [begin, stop] = [momentOf(from.value), momentOf(until.value)];
    if (!(begin < stop)) return problem.paint(new Error('“From” must be before “To”.'));
    picker.open = false;
    go(() => span.fix(begin, stop));
  }

  const zoomed = (begin, stop) => go(() => (begin === null ? span.follow(hour) : span.fix(begin, stop)));
  const pointed = (time) => {
    table.point(time);
    for (const plot of plots.values()) plot.point(time);
  };

  function paintControls([begin, stop]) {
    const {range} = span.parameters();
    for (const one of presets) one.setAttribute('aria-pressed', String(one.dataset.range === range));
    headline.name(set ? `Trends: ${set}` : 'Trends');
    setText(about, `${civilSeconds(Math.round(begin))} to ${civilSeconds(Math.round(stop))} ${zoneName()} (${ageText(stop - begin)})${
      span.end === null ? ', moves with the time' : ''}${session.history ? '' : '; this gateway records no history: values begin when a point is chosen on this page'}`);
    csv.hidden = !session.history || !picked.list().length;
    csv.href = csvLink(picked.list(), begin, stop);
  }

  const panelsOf = (ones) => {
    const panels = new Map();
    for (const one of ones) {
      const key = single ? one.series.point : one.series.unit || '';
      panels.set(key, [...(panels.get(key) || []), one]);
    }
    return panels;
  };

  const limitsFor = (ones) => [...new Map(ones.flatMap(({series}) => limitsOf(described.get(series.point)))
      .map((one) => [one.value, one])).values()];

  /** The charts together fill the window below the controls. */
  function fit() {
    const room = innerHeight - charts.getBoundingClientRect().top - scrollY - 12;
    charts.style.height = plots.size ? `${Math.max(room, plots.size * lowest)}px` : '';
  }

  function paint() {
    const started = performance.now();
    const [begin, stop] = shownSpan;
    const panels = panelsOf(list.filter((one) => !one.failure));
    for (const [key, plot] of plots) {
      if (panels.has(key)) continue;
      plot.end();
      plots.delete(key);
    }
    for (const key of panels.keys()) {
      if (plots.has(key)) continue;
      plots.set(key, new Plot({zoomed, pointed}));
      charts.append(plots.get(key).element);
    }
    fit();
    for (const [key, ones] of panels) {
      const curves = ones.map(({number, series}) => ({number, series, name: series.point, point: described.get(series.point)}));
      const devices = new Set(ones.map(({series}) => deviceOf(series.point)));
      plots.get(key).show({curves, from: begin, until: stop, marks: marks.filter((mark) => devices.has(mark.device)),
        limits: limitsFor(ones), title: [ones[0].series.unit || 'without a unit', ...curves.map(({number, name}) =>
          h('span', {}, sample(number), name))]});
    }
    table.paint(list);
    charts.dataset.drawn = ++drawn;
    charts.dataset.drawMs = (performance.now() - started).toFixed(1);
  }

  let shownSpan = span.now();
  async function ask() {
    const mine = ++round;
    const names = picked.list();
    const window = span.now();
    paintControls(window);
    const pixels = Math.min(mostPixels, Math.max(100, charts.clientWidth - 60));
    const missing = names.filter((name) => !described.has(name));
    if (missing.length) described = new Map([...described, ...await describe(missing).catch(() => [])]);
    if (withMarks.checked && session.events && Date.now() - marksAt > marksPeriod) {
      marksAt = Date.now();
      marks = (await Promise.all(devicesOf(names).map((device) => fetchMarks(device, ...window).catch(() => [])))).flat();
    } else if (!withMarks.checked) {
      marks = [];
    }
    const found = await Promise.all(names.map((name, number) => fetchSeries(name, ...window, pixels).then(
        (series) => ({number, series, point: described.get(name)}),
        (error) => ({number, series: {point: name, unit: '', step_ms: 1, rows: []}, failure: error.message}))));
    if (mine !== round) return;
    list = found;
    shownSpan = window;
    problem.paint(null);
    paint();
  }

  function refresh() {
    end();
    marksAt = 0;
    const period = span.end !== null ? hour : Math.max(session.history ? 5000 : 1000, span.length / mostPixels);
    end = repeat(ask, () => {}, (error) => problem.paint(error), period);
  }
  address(replace);
  refresh();
  const resized = () => plots.size && fit();
  addEventListener('resize', resized);
  const ends = [on('picked', () => {
    address(replace);
    refresh();
  }), adding.end, () => removeEventListener('resize', resized)];
  return {
    moved(parameters) {
      span = new Span(parameters);
      set = parameters.set || '';
      sets.paint(set);
      single = byCurve.checked = parameters.panels === 'curve';
      if (parameters.points) picked.set(parameters.points.split(',').filter(Boolean));
      refresh();
    },
    end() {
      ++round;
      end();
      ends.forEach((stop) => stop());
      for (const plot of plots.values()) plot.end();
    },
  };
}
