// SPDX-License-Identifier: Apache-2.0
// The audit of writes: who has changed what, newest first.
import {get} from './api.js';
import {now} from './clock.js';
import {linked} from './columns.js';
import {DataTable} from './data_table.js';
import {h} from './dom.js';
import {civilSeconds, inWords, pointText, who} from './format.js';
import {deviceLink, replace, writesLink} from './links.js';
import {Headline, Problem, select} from './parts.js';
import {describe} from './store.js';
import {zoneName} from './zone.js';

const day = 86400e3;
const spans = {1: 'last 24 hours', 7: 'last 7 days', 30: 'last 30 days'};
const mostPages = 50;
const mostShown = 500;

const nameOf = (w) => `${w.line}.${w.device}.${w.point}`;

const columns = () => [
  {title: `Time (${zoneName()})`, class: 'time', text: (w) => civilSeconds(w.time)},
  {title: 'Who', class: 'words', text: (w) => who(w.client)},
  linked('Point', (w) => [[w.line, w.device, w.point].filter(Boolean).join('.'), deviceLink(w, w.point)], 'name own-line'),
  {title: 'Old value', class: 'num', text: (w) => pointText(w.point_is, w.old)},
  {title: 'New value', class: 'num', text: (w) => pointText(w.point_is, w.new)},
  {title: 'Result', class: 'outcome', text: (w) => inWords(w.outcome)},
  {title: 'Reason', class: 'said', text: (w) => [w.reason, w.count > 1 ? `${w.count} times` : ''].filter(Boolean).join(', ')},
];

export function writes(root, _, given) {
  const table = new DataTable({columns: columns(), key: (w) => w.seq, caption: 'Writes, newest first', empty: 'Nobody has written anything.'});
  const problem = new Problem();
  const text = h('input', {type: 'search', id: 'write-text', placeholder: 'Point or user', value: given.q || '', oninput: () => {
    replace(writesLink({q: text.value}));
    paint();
  }});
  let list = [];
  let days = '7';
  let round = 0;
  const paint = () => {
    const word = text.value.trim().toLowerCase();
    table.paint(list.filter((w) => `${nameOf(w)} ${w.client}`.toLowerCase().includes(word)).slice(-mostShown).reverse());
  };
  const refresh = async () => {
    const mine = ++round;
    const found = [];
    try {
      for (let after = 0, pages = 0; pages < mostPages; ++pages) {
        const page = await get('writes', {after, since_ms: Math.round(now() - days * day)});
        found.push(...page.records);
        if (!page.more) break;
        after = page.next;
      }
    } catch (error) {
      return problem.paint(error);
    }
    const points = await describe(found.filter((w) => w.point).map(nameOf)).catch(() => new Map());
    if (mine !== round) return;
    list = found.map((w) => ({...w, point_is: points.get(nameOf(w))}));
    problem.paint(null);
    paint();
  };
  root.append(new Headline('Writes').element, h('div', {class: 'controls no-print'}, select('Time', Object.entries(spans), days, (value) => {
    days = value;
    refresh();
  }), h('label', {for: 'write-text', class: 'hidden'}, 'Point or user'), text), problem.element, table.element);
  refresh();
  return () => ++round;
}
