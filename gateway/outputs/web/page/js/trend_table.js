// SPDX-License-Identifier: Apache-2.0
// The legend of trends: the line style of each point, and its figures.
import {pressed} from './columns.js';
import {DataTable} from './data_table.js';
import {h, setText, svg} from './dom.js';
import {civilSeconds, valueText} from './format.js';
import {dashes} from './plot.js';
import * as picked from './picked.js';
import {csvLink, rowAt, summary} from './series.js';
import {session} from './session.js';

const short = (value) => (value === undefined || value === null ? '–' : valueText(Number(value.toPrecision(6))));

function sample(cell) {
  const line = svg('path', {d: 'M0 4h36'});
  const picture = svg('svg', {'viewBox': '0 0 36 8', 'aria-hidden': 'true'}, line);
  cell.append(picture);
  return {picture, line};
}

export function trendTable() {
  let time = null;
  let shown = [];
  const columns = [
    {title: 'Line', class: 'sample', make: sample, paint: ({picture, line}, {number}) => {
      picture.setAttribute('class', `series-${number}`);
      line.setAttribute('stroke-dasharray', (dashes[number] || []).join(' '));
    }},
    {title: 'Point', class: 'said', text: (one) => one.series.point + (one.failure ? `\n${one.failure}` : '')},
    {title: 'Unit', text: (one) => one.series.unit},
    {title: 'At the cursor', class: 'num', text: (one) => {
      const row = time === null ? null : rowAt(one.series, time);
      if (!row) return '–';
      return row[1] === row[3] ? short(row[2]) : `${short(row[2])} (${short(row[1])} … ${short(row[3])})`;
    }},
    {title: 'Minimum', class: 'num', text: (one) => short(one.sum?.min)},
    {title: 'Mean', class: 'num', text: (one) => short(one.sum?.mean)},
    {title: 'Maximum', class: 'num', text: (one) => short(one.sum?.max)},
    {title: 'Last', class: 'num', text: (one) => short(one.sum?.last)},
    {title: 'File', class: 'no-print', make: (cell) => cell.appendChild(h('a', {download: ''}, 'CSV')), paint: (a, one) => {
      a.hidden = !session.history || Boolean(one.failure);
      a.href = csvLink(one.series.point, one.from, one.until);
      a.setAttribute('aria-label', `CSV of ${one.series.point}`);
    }},
    pressed('Remove', 'Remove', picked.toggle, (one) => ({value: one.series.point, label: `Remove ${one.series.point}`})),
  ];
  const table = new DataTable({columns, key: (one) => one.series.point, caption: 'Points of the chart',
    empty: 'No points are chosen: add some above, or with “+ Trend” beside a point.'});
  const cursor = h('p', {class: 'about'});
  return {
    element: h('div', {class: 'trend-table'}, cursor, table.element,
        h('p', {class: 'about'}, 'Band: minimum to maximum. Hatched: not every value was good. Gap: no values.')),
    paint(list, from, until) {
      shown = list.map((one) => ({...one, from, until, sum: summary(one.series)}));
      table.paint(shown);
    },
    point(at) {
      time = at;
      setText(cursor, at === null ? '' : `Cursor at ${civilSeconds(at)}`);
      table.paint(shown);
    },
  };
}
