// SPDX-License-Identifier: Apache-2.0
// The user's favourite points, stored in this browser, and their view: a tile for each.
import {emit, on} from './bus.js';
import {age, setAge} from './clock.js';
import {h, mark, setClass, setMark, setText} from './dom.js';
import {deviceLink, trendsLink} from './links.js';
import {recall, remember} from './memory.js';
import {Headline, Problem} from './parts.js';
import {Spark, lastHour} from './spark.js';
import {beyond, beyondText, describe, kindOf, limitsOf, resting, shownOf, valueOf} from './store.js';
import {qualityMark} from './format.js';

let names = recall('favourites', []).filter((n) => typeof n === 'string');

export const list = () => [...names];
export const has = (name) => names.includes(name);

export function toggle(name) {
  names = has(name) ? names.filter((n) => n !== name) : [...names, name];
  remember('favourites', names);
  emit('favourites');
}

/** A button that makes a point a favourite; paint(name) shows whether it is one. */
export function star() {
  const button = h('button', {type: 'button', class: 'star', onclick: () => {
    toggle(button.value);
    paint(button.value);
  }});
  const paint = (name) => {
    button.value = name;
    const is = has(name);
    setText(button, is ? '★' : '☆');
    button.setAttribute('aria-pressed', String(is));
    button.setAttribute('aria-label', `Favourite: ${name}`);
    button.title = is ? 'Not a favourite any more' : 'Make it a favourite';
  };
  return {element: button, paint};
}

class Tile {
  constructor(name, point) {
    this.point = point;
    this.value = h('strong', {class: 'tile-value'});
    this.shape = mark('fine');
    this.quality = h('span');
    this.limit = h('span', {class: 'beyond'});
    this.since = age();
    this.spark = new Spark();
    const mine = star();
    mine.paint(name);
    this.element = h('article', {class: 'tile'},
        h('h2', {}, h('a', {href: point ? deviceLink(point, point.point) : '#/points'}, point ? point.point : name), mine.element),
        h('p', {class: 'about'}, point ? `${point.line}.${point.device}` : 'There is no such point any more.'),
        point ? [h('p', {class: 'tile-line'}, this.value, h('span', {}, point.unit || '')),
          h('a', {class: 'tile-spark', href: trendsLink({points: name, range: '1h'}), 'aria-label': `Trend of ${name}`,
            hidden: !point.kept}, this.spark.element),
          h('p', {class: 'tile-quality'}, this.shape, h('span', {}, this.quality, this.limit), this.since)] : null);
  }

  paint() {
    const live = this.point && valueOf(this.point.id);
    if (!live) return;
    const kind = kindOf(this.point, live);
    setText(this.value, shownOf(live) || '–');
    this.value.title = String(live.value);
    const passed = beyond(this.point, live);
    setMark(this.shape, passed ? 'warn' : resting(live) ? 'off' : qualityMark[kind]);
    setText(this.limit, beyondText(passed));
    setText(this.quality, live.text);
    setClass(this.element, `tile ${kind}`);
    setAge(this.since, live.at);
  }

  paintSpark() {
    if (this.point?.kept) lastHour(this.point.name, (hour) => this.spark.paint(hour, limitsOf(this.point)), () => this.element.isConnected);
  }
}

export function favourites(root) {
  const problem = new Problem();
  const tiles = h('div', {class: 'tiles'});
  const none = h('p', {class: 'empty', hidden: true}, 'No favourites: press the star beside a point.');
  let shown = new Map();
  root.append(new Headline('Favourites').element, problem.element, none, tiles);
  const build = () => describe(names).then((byName) => {
    const made = names.map((name) => new Tile(name, byName.get(name)));
    shown = new Map(made.filter((tile) => tile.point).map((tile) => [tile.point.id, tile]));
    tiles.replaceChildren(...made.map((tile) => tile.element));
    none.hidden = made.length > 0;
    for (const tile of made) {
      tile.paint();
      tile.paintSpark();
    }
  }, (error) => problem.paint(error));
  build();
  const timer = setInterval(() => document.hidden || shown.forEach((tile) => tile.paintSpark()), 60e3);
  const ends = [on('points', build), on('values', (ids) => {
    for (const [id, tile] of shown) if (ids.has(id)) tile.paint();
  }), () => clearInterval(timer)];
  return () => ends.forEach((end) => end());
}
