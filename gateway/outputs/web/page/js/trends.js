// SPDX-License-Identifier: Apache-2.0
// The view of trends: up to eight points over an hour to a year.
import {on} from './bus.js';
import {now} from './clock.js';
import {h, setText} from './dom.js';
import {ageText, civilSeconds} from './format.js';
import {replace, trendsLink} from './links.js';
import {Headline, Problem} from './parts.js';
import * as picked from './picked.js';
import {loadCharts, Plot} from './plot.js';
import {pointPicker} from './point_picker.js';
import {fetchSeries} from './series.js';
import {session} from './session.js';
import {repeat} from './status.js';
import {trendTable} from './trend_table.js';

const hour = 3600e3;
const ranges = {'1h': ['1 hour', hour], '6h': ['6 hours', 6 * hour], '24h': ['1 day', 24 * hour],
  '7d': ['1 week', 168 * hour], '30d': ['30 days', 720 * hour], '365d': ['1 year', 8760 * hour]};
const mostPixels = 1200;
const shortest = 10e3;

/** The time that the charts show: the last hours up to now, or a span that the user has chosen. */
class Span {
  constructor({range, from, until}) {
    this.range = range in ranges ? range : '1h';
    this.fixed = Number(from) < Number(until) ? [Number(from), Number(until)] : null;
  }

  now() {
    return this.fixed || [now() - ranges[this.range][1], now()];
  }

  parameters() {
    return this.fixed ? {from: Math.round(this.fixed[0]), until: Math.round(this.fixed[1])} : {range: this.range};
  }

  choose(range) {
    this.range = range;
    this.fixed = null;
  }

  fix(from, until) {
    const end = Math.min(until, now());
    this.fixed = [Math.min(from, end - shortest), end];
  }

  /** Moves the span by `move` times its length, and scales its length around its middle. */
  change(move, scale) {
    const [from, until] = this.now();
    const length = (until - from) * scale;
    const middle = (from + until) / 2 + move * (until - from);
    this.fix(middle - length / 2, middle + length / 2);
  }
}

export function trends(root, _, parameters) {
  if (parameters.points) picked.set(parameters.points.split(',').filter(Boolean));
  const span = new Span(parameters);
  const problem = new Problem();
  const about = h('p', {class: 'about', role: 'status'});
  const charts = h('div', {class: 'plots'});
  const table = trendTable();
  const plots = new Map();
  const buttons = Object.entries(ranges).map(([key, [text]]) =>
    h('button', {type: 'button', 'data-range': key, onclick: () => go(() => span.choose(key))}, text));
  const move = (text, by, scale, label) =>
    h('button', {type: 'button', 'aria-label': label, onclick: () => go(() => span.change(by, scale))}, text);
  const controls = h('div', {class: 'controls no-print'},
      h('div', {class: 'group', role: 'group', 'aria-label': 'Time shown'}, buttons),
      h('div', {class: 'group', role: 'group', 'aria-label': 'Move and zoom'}, move('◀', -0.5, 1, 'Earlier'),
          move('▶', 0.5, 1, 'Later'), move('+', 0, 0.5, 'Zoom in'), move('−', 0, 2, 'Zoom out')));
  const headline = new Headline('Trends');
  root.append(headline.element, pointPicker(), controls, problem.element, about, charts, table.element);

  let list = [];
  let round = 0;
  let drawn = 0;

  function go(change) {
    change();
    refresh();
  }

  const zoomed = (from, until) => go(() => (from === null ? span.choose(span.range) : span.fix(from, until)));
  const pointed = (time) => table.point(time);

  function paintControls([from, until]) {
    replace(trendsLink({points: picked.list().join(','), ...span.parameters()}));
    for (const button of buttons) {
      button.setAttribute('aria-pressed', String(!span.fixed && button.dataset.range === span.range));
    }
    const text = `${civilSeconds(Math.round(from))} to ${civilSeconds(Math.round(until))} (${ageText(until - from)})`;
    setText(about, `${text}${span.fixed ? '' : ', moves with the time'}${session.history ? ''
      : '; this gateway records no history: values begin when a point is chosen on this page'}`);
  }

  function paint([from, until]) {
    const begin = performance.now();
    const units = byUnit(list.filter((one) => !one.failure));
    for (const [unit, plot] of plots) {
      if (units.has(unit)) continue;
      plot.end();
      plots.delete(unit);
    }
    for (const [unit, ones] of units) {
      const key = ones.map((one) => one.series.point).join();
      if (plots.has(unit) && plots.get(unit).key !== key) {
        plots.get(unit).end();
        plots.delete(unit);
      }
      if (!plots.has(unit)) {
        const plot = new Plot(zoomed, pointed);
        plot.key = key;
        plots.set(unit, plot);
        charts.append(plot.element);
      }
      plots.get(unit).show(unit, ones, from, until);
    }
    table.paint(list, from, until);
    charts.dataset.drawn = ++drawn;
    charts.dataset.drawMs = (performance.now() - begin).toFixed(1);
  }

  async function ask() {
    const mine = ++round;
    const names = picked.list();
    const window = span.now();
    paintControls(window);
    await loadCharts();
    const pixels = Math.min(mostPixels, Math.max(100, charts.clientWidth - 60));
    const found = await Promise.all(names.map((name, number) => fetchSeries(name, ...window, pixels).then(
        (series) => ({number, series}),
        (error) => ({number, series: {point: name, unit: '', step_ms: 1, rows: []}, failure: error.message}))));
    if (mine !== round) return;
    list = found;
    problem.paint(null);
    paint(window);
  }

  let end = () => {};
  function refresh() {
    end();
    const [from, until] = span.now();
    const period = span.fixed ? 3600e3 : Math.max(session.history ? 5000 : 1000, (until - from) / mostPixels);
    end = repeat(ask, () => {}, (error) => problem.paint(error), period);
  }
  refresh();
  const ends = [on('picked', refresh)];
  return () => {
    ++round;
    end();
    ends.forEach((stop) => stop());
    for (const plot of plots.values()) plot.end();
  };
}

function byUnit(list) {
  const units = new Map();
  for (const one of list) units.set(one.series.unit || '', [...(units.get(one.series.unit || '') || []), one]);
  return units;
}
