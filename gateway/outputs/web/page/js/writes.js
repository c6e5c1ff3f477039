// SPDX-License-Identifier: Apache-2.0
// The audit of writes: who has changed what, newest first.
import {get} from './api.js';
import {now} from './clock.js';
import {linked} from './columns.js';
import {DataTable} from './data_table.js';
import {h} from './dom.js';
import {civilSeconds, inWords, valueText} from './format.js';
import {deviceLink} from './links.js';
import {folded, Problem, select} from './parts.js';
import {zoneName} from './zone.js';

const day = 86400e3;
const spans = {1: 'last 24 hours', 7: 'last 7 days', 30: 'last 30 days'};
const mostPages = 50;
const mostShown = 500;

const columns = () => [
  {title: `Time (${zoneName()})`, class: 'time', text: (w) => civilSeconds(w.time)},
  {title: 'Who', class: 'words', text: (w) => w.client},
  linked('Point', (w) => [[w.line, w.device, w.point].filter(Boolean).join('.'), deviceLink(w, w.point)], 'name own-line'),
  {title: 'Old value', class: 'num', text: (w) => valueText(w.old)},
  {title: 'New value', class: 'num', text: (w) => valueText(w.new)},
  {title: 'Result', text: (w) => inWords(w.outcome)},
  {title: 'Reason', class: 'said', text: (w) => [w.reason, w.count > 1 ? `${w.count} times` : ''].filter(Boolean).join(', ')},
];

export function writesPart() {
  const table = new DataTable({columns: columns(), key: (w) => w.seq, caption: 'Writes, newest first', empty: 'Nobody has written anything.'});
  const problem = new Problem();
  const text = h('input', {type: 'search', id: 'write-text', placeholder: 'Point or user', oninput: () => paint()});
  let list = [];
  let days = '7';
  let round = 0;
  const paint = () => {
    const word = text.value.trim().toLowerCase();
    table.paint(list.filter((w) => `${w.line}.${w.device}.${w.point} ${w.client}`.toLowerCase().includes(word)).slice(-mostShown).reverse());
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
    if (mine !== round) return;
    list = found;
    problem.paint(null);
    paint();
  };
  const part = folded('Writes: who has changed what', h('div', {class: 'controls no-print'}, select('Time', Object.entries(spans), days, (value) => {
    days = value;
    refresh();
  }), h('label', {for: 'write-text', class: 'hidden'}, 'Point or user'), text), problem.element, table.element);
  part.addEventListener('toggle', () => part.open && refresh());
  return part;
}
