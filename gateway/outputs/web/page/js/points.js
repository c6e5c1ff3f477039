// SPDX-License-Identifier: Apache-2.0
// The view of all points: filters, an order, and the lines and devices that the search finds.
import {alarmSource, allAlarms, priorityMark} from './alarm_bar.js';
import {get} from './api.js';
import {on} from './bus.js';
import {count, deviceTrouble, lineTrouble, stateWord, lineState} from './format.js';
import {h, mark, setText} from './dom.js';
import {deviceLink, lineLink, pointsLink, replace, sourceLink} from './links.js';
import {Headline, Problem, select} from './parts.js';
import {PointTable} from './point_table.js';
import {wish} from './search.js';
import {allPoints, kindOf, matching, valueOf, writable, wordsOf} from './store.js';

const mostFound = 8;
const kinds = {good: 0, none: 1, uncertain: 2, bad: 3};

const orders = {
  name: (a, b) => (a.name < b.name ? -1 : 1),
  value: (a, b) => Number(valueOf(b.id)?.value ?? -Infinity) - Number(valueOf(a.id)?.value ?? -Infinity),
  quality: (a, b) => kinds[kindOf(b, valueOf(b.id))] - kinds[kindOf(a, valueOf(a.id))],
  age: (a, b) => (valueOf(a.id)?.at ?? 0) - (valueOf(b.id)?.at ?? 0),
};

export function points(root, _, parameters) {
  const nothing = {q: '', line: '', quality: '', writable: '', sort: ''};
  const chosen = {...nothing, ...parameters};
  const headline = new Headline('Points');
  const problem = new Problem();
  const found = h('p', {class: 'about', role: 'status'}, 'Fetching the points …');
  const places = h('ul', {class: 'places', hidden: true, 'aria-label': 'Lines, devices and alarms found'});
  const table = new PointTable({full: true, label: 'Points', sorted: (key) => {
    chosen.sort = chosen.sort === key ? `-${key}` : chosen.sort === `-${key}` ? '' : key;
    change();
  }});
  let all = null;
  let list = [];
  let things = null;
  let hits = [];
  const line = select('Line', [['', 'all']], '', (value) => change({line: value}));
  const quality = select('Quality', [['', 'all'], ['good', 'good'], ['poor', 'not good']], chosen.quality, (value) => change({quality: value}));
  const sort = select('Sort by', [['', 'configuration'], ['name', 'name'], ['-value', 'smallest value'], ['value', 'largest value'], ['quality', 'worst quality'],
    ['age', 'oldest']], chosen.sort, (value) => change({sort: value}));
  sort.classList.add('small-only');
  const only = h('input', {type: 'checkbox', checked: Boolean(chosen.writable), onchange: () => change({writable: only.checked ? '1' : ''})});
  const change = (some = {}) => {
    Object.assign(chosen, some);
    replace(pointsLink(chosen));
    paint();
  };
  /** Opens the first thing found, as soon as everything is known, if the user has pressed Enter. */
  const openFirst = () => {
    if (!wish.text || wish.text !== chosen.q.trim() || !all || !things) return;
    wish.text = '';
    location.hash = hits[0] && (!hits[0].last || !list.length) ? hits[0].href : list.length ? deviceLink(list[0], list[0].point) : location.hash;
  };
  const paint = () => {
    if (!all) return;
    list = matching(all, chosen.q).filter((point) => (!chosen.line || point.line === chosen.line)
      && (!chosen.writable || writable(point)) && (!chosen.quality || kindOf(point, valueOf(point.id)) === chosen.quality
      || (chosen.quality === 'poor' && ['bad', 'uncertain'].includes(kindOf(point, valueOf(point.id))))));
    const key = chosen.sort.replace('-', '');
    if (orders[key]) list = [...list].sort(chosen.sort === key ? orders[key] : (a, b) => orders[key](b, a));
    table.order(key, (key === 'name') !== (chosen.sort === key));
    const filtered = chosen.line || chosen.writable || chosen.quality;
    setText(found, chosen.q ? `${count(list.length)} of ${count(all.length)} points have “${chosen.q}”`
      : filtered ? `${count(list.length)} of ${count(all.length)} points` : `${count(all.length)} points; the search box finds them by name and description`);
    table.paint(list);
    paintPlaces();
    openFirst();
  };
  const paintPlaces = () => {
    const words = wordsOf(chosen.q);
    hits = words.length && things ? things.filter(({name}) => words.every((word) => name.toLowerCase().includes(word))) : [];
    hits = hits.sort((a, b) => Boolean(a.last) - Boolean(b.last) || a.name.length - b.name.length).slice(0, mostFound);
    places.hidden = !hits.length;
    places.replaceChildren(...hits.map(({name, href, kind, state}, i) => h('li', {}, mark(kind), h('a', {href}, name), h('span', {class: 'about'}, state),
        i || (hits[0].last && list.length) ? null : h('kbd', {}, 'Enter'))));
  };
  const fetchAll = () => allPoints().then((answer) => {
    all = answer;
    problem.paint(null);
    const options = line.querySelector('select');
    const names = [...new Set(all.map((point) => point.line))];
    options.replaceChildren(...['', ...names].map((name) => h('option', {value: name, selected: name === chosen.line}, name || 'all')));
    paint();
  }, (error) => problem.paint(error));
  const fetchThings = () => Promise.all([get('status'), allAlarms().catch(() => [])]).then(([status, alarms]) => {
    things = status.lines.flatMap((one) => [{name: one.name, href: lineLink(one.name), kind: lineTrouble(one).shape, state: lineState(one)},
      ...one.devices.map((d) => ({name: `${one.name}.${d.name}`, href: deviceLink({line: one.name, device: d.name}),
        kind: deviceTrouble(d).shape, state: stateWord(d)}))]);
    things.push(...alarms.map((alarm) => ({name: `${alarmSource(alarm)}: ${alarm.text}`, href: sourceLink(alarm), kind: priorityMark[alarm.priority],
      state: `alarm, ${alarm.priority}`, last: true})));
    paintPlaces();
    openFirst();
  }, () => {
    things = [];
    openFirst();
  });
  root.append(headline.element, problem.element, h('div', {class: 'controls no-print'}, line, quality,
      h('label', {class: 'check'}, only, 'Writable'), sort, found), places, table.element);
  fetchAll();
  fetchThings();
  const ends = [on('points', fetchAll), on('search', (query) => {
    chosen.q = query;
    paint();
  }), on('open', openFirst), () => table.end()];
  return {
    moved(now) {
      Object.assign(chosen, nothing, now);
      for (const [part, key] of [[line, 'line'], [quality, 'quality'], [sort, 'sort']]) part.querySelector('select').value = chosen[key];
      only.checked = Boolean(chosen.writable);
      paint();
    },
    end: () => ends.forEach((end) => end()),
  };
}
