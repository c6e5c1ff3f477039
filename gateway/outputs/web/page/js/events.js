// SPDX-License-Identifier: Apache-2.0
// The table of recorded events, newest first, with filters and a CSV file; new events are added as they come.
import {address, get} from './api.js';
import {now} from './clock.js';
import {linked} from './columns.js';
import {DataTable} from './data_table.js';
import {h, setText} from './dom.js';
import {civil, count, inWords, valueText} from './format.js';
import {alarmsLink, replace, sourceLink} from './links.js';
import {Problem, select} from './parts.js';
import {repeat} from './status.js';
import {zoneName} from './zone.js';

const hour = 3600e3;
const spans = {'1h': hour, '24h': 24 * hour, '7d': 168 * hour, '30d': 720 * hour, all: 0};
const mostPages = 25;
const step = 100;

const clocks = ['no device time', 'gateway', 'device', 'minute guessed', 'out of step'];

function record(cell, kept) {
  if (!kept) return cell.replaceChildren();
  const summary = `${kept.name}: ${kept.state}`;
  if (!kept.values || !kept.values.length) return cell.replaceChildren(summary);
  cell.replaceChildren(h('details', {}, h('summary', {}, summary), h('ul', {class: 'values'},
      kept.values.map((v) => h('li', {}, `${v.name} ${valueText(v.value)} ${v.unit}`
        + (v.quality === 192 ? '' : ` (${v.quality_text})`))))));
}

const columns = () => [
  {title: 'No.', class: 'num', text: (e) => e.seq},
  {title: `Time (${zoneName()})`, class: 'time', text: (e) => civil(e.device_time)},
  {title: 'Clock', text: (e) => clocks[e.clock_quality] || e.clock_quality},
  linked('Source', (e) => [[e.line, e.device].filter(Boolean).join('.') || 'gateway', sourceLink(e)]),
  {title: 'Kind', text: (e) => e.state},
  {title: 'Priority', text: (e) => (e.priority === 'none' ? '–' : e.priority)},
  {title: 'Event', class: 'said', text: (e) => (e.channel ? `channel ${e.channel}: ` : '') + inWords(e.text)},
  {title: 'Record', make: () => ({}), paint: (made, e, cell) => {
    const signature = e.record ? `${e.seq} ${e.record.state}` : '';
    if (made.signature === signature) return;
    made.signature = signature;
    record(cell, e.record);
  }},
];

export function eventsPart(given) {
  const chosen = {device: given.device || '', line: given.line || '', since: given.since in spans ? given.since : '24h',
    kind: given.kind || '', priority: given.priority || '', text: given.text || ''};
  const table = new DataTable({columns: columns(), key: (e) => e.seq, caption: 'Events, newest first', empty: 'No events of that kind.'});
  const problem = new Problem();
  const summary = h('p', {class: 'about', role: 'status'});
  const more = h('button', {type: 'button', hidden: true, onclick: () => {
    limit += step;
    paint();
  }});
  const csv = h('a', {class: 'button', download: ''}, 'CSV');
  let list = [];
  let next = 0;
  let limit = step;
  let cut = false;
  let round = 0;
  const paint = () => {
    const wanted = list.filter((e) => !chosen.line || e.line === chosen.line);
    const newest = wanted.slice(-limit).reverse();
    table.paint(newest);
    more.hidden = newest.length === wanted.length;
    setText(more, `Show ${count(Math.min(step, wanted.length - newest.length))} older`);
    setText(summary, `${count(wanted.length)} events${cut ? '; the page has not fetched all events: choose a shorter time' : ''}`);
  };
  const parameters = () => ({target: chosen.device, kind: chosen.kind, priority: chosen.priority, text: chosen.text.trim(),
    since_ms: spans[chosen.since] ? Math.round(now() - spans[chosen.since]) : undefined});
  /** Fetches at most mostPages pages from `next` on, because a filter without a beginning may match very many events. */
  const fetchNew = async () => {
    const mine = round;
    for (let pages = 0; pages < mostPages; ++pages) {
      const page = await get('events', {after: next, ...parameters()});
      if (mine !== round) return null;
      list.push(...page.records);
      next = Math.max(next, page.next || 0);
      cut = page.more;
      if (!page.more) break;
    }
    if (list.length > 20000) list.splice(0, list.length - 20000);
    return list;
  };
  const begin = () => {
    ++round;
    list = [];
    next = 0;
    limit = step;
    csv.href = address('events.csv', parameters());
    poll();
  };
  let end = () => {};
  const poll = () => {
    end();
    end = repeat(fetchNew, (found) => {
      problem.paint(null);
      if (found) paint();
    }, (error) => problem.paint(error), 2000);
  };
  const change = (name) => (value) => {
    chosen[name] = value;
    replace(alarmsLink(chosen));
    if (name === 'device') chosen.line = '';
    begin();
  };
  const device = select('Device', [['', chosen.line ? `all of ${chosen.line}` : 'all'],
    ...(chosen.device ? [[chosen.device, chosen.device]] : [])], chosen.device, change('device'));
  const options = device.querySelector('select');
  get('status').then((status) => {
    const names = status.lines.flatMap((l) => l.devices.map((d) => `${l.name}.${d.name}`));
    options.append(...names.filter((n) => n !== chosen.device).map((n) => h('option', {value: n}, n)));
  }, () => {});
  let typing = 0;
  const text = h('input', {type: 'search', id: 'event-text', placeholder: 'Text', value: chosen.text, oninput: () => {
    clearTimeout(typing);
    typing = setTimeout(() => change('text')(text.value), 300);
  }});
  const controls = h('div', {class: 'controls no-print'}, device,
      select('Time', [['1h', 'last hour'], ['24h', 'last 24 hours'], ['7d', 'last 7 days'], ['30d', 'last 30 days'],
        ['all', 'all']], chosen.since, change('since')),
      select('Kind', [['', 'all'], ['on', 'on'], ['off', 'off'], ['message', 'message']], chosen.kind, change('kind')),
      select('Priority', [['', 'all'], ['high', 'high'], ['medium', 'medium'], ['low', 'low'], ['none', 'no alarm']], chosen.priority, change('priority')),
      h('label', {for: 'event-text', class: 'hidden'}, 'Text of the event'), text, csv, summary);
  begin();
  return {element: h('div', {}, controls, problem.element, table.element, more), end: () => {
    clearTimeout(typing);
    ++round;
    end();
  }};
}
