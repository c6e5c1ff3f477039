// SPDX-License-Identifier: Apache-2.0
// The figures of trends: a row for each curve.
import {linked, pressed} from './columns.js';
import {DataTable} from './data_table.js';
import {h, setText, svg} from './dom.js';
import {civilSeconds, pointText} from './format.js';
import {deviceLink} from './links.js';
import {dashes} from './plot.js';
import * as picked from './picked.js';
import {rowAt, spread, summary} from './series.js';

/** A piece of a curve's line, as the chart draws it. */
export function sample(number) {
  const line = svg('path', {d: 'M0 4h28', 'stroke-dasharray': (dashes[number] || []).join(' ')});
  return svg('svg', {'viewBox': '0 0 28 8', 'aria-hidden': 'true', class: `sample series-${number}`}, line);
}

const lastText = (point, row) => (!row ? '–' : point?.states ? spread(point, row) : pointText(point, row[2]));

export function trendTable() {
  let time = null;
  let shown = [];
  const columns = [
    {title: 'Curve', class: 'sample-cell', make: () => ({}), paint: (made, {number}, cell) => {
      if (made.number !== number) cell.replaceChildren(sample(number));
      made.number = number;
    }},
    linked('Point', ({series: {point}}) => {
      const [line, device, ...rest] = point.split('.');
      return [point, deviceLink({line, device}, rest.join('.'))];
    }, 'name own-line'),
    {title: 'Unit', text: (one) => one.series.unit || '–'},
    {title: 'At the cursor', class: 'num', text: (one) => {
      const row = time === null ? null : rowAt(one.series, time);
      if (!row) return '–';
      return spread(one.point, row);
    }},
    {title: 'Minimum', class: 'num', text: (one) => pointText(one.point, one.sum?.min)},
    {title: 'Mean', class: 'num', text: (one) => (one.point?.states ? '–' : pointText(one.point, one.sum?.mean))},
    {title: 'Maximum', class: 'num', text: (one) => pointText(one.point, one.sum?.max)},
    {title: 'Last', class: 'num', text: (one) => lastText(one.point, one.series.rows.at(-1))},
    {title: 'Remark', class: 'remark', text: (one) => one.failure || ''},
    pressed('Remove', 'Remove', picked.toggle, (one) => ({value: one.series.point, label: `Remove ${one.series.point}`})),
  ];
  const table = new DataTable({columns, key: (one) => one.series.point, caption: 'Points of the chart',
    empty: 'No points are chosen: add some above, or click the small curve beside a value.'});
  const cursor = h('p', {class: 'about'});
  const legend = h('p', {class: 'about'}, 'Band: minimum to maximum. Strip below the axis: not every value was good. Gap: no values.');
  return {
    element: h('div', {class: 'trend-table'}, cursor, table.element, legend),
    paint(list) {
      shown = list.map((one) => ({...one, sum: summary(one.series)}));
      table.paint(shown);
      legend.hidden = !list.length;
    },
    point(at) {
      time = at;
      setText(cursor, at === null ? '' : `Cursor at ${civilSeconds(Math.round(at))}`);
      table.paint(shown);
    },
  };
}
