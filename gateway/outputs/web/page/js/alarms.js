// SPDX-License-Identifier: Apache-2.0
// The view of alarms: a live list of alarms that are not normal, and the events with their filters.
import {alarmSource, allAlarms, priorityMark, unseen} from './alarm_bar.js';
import {on} from './bus.js';
import {aged, linked, marked} from './columns.js';
import {DataTable} from './data_table.js';
import {h} from './dom.js';
import {eventsPart} from './events.js';
import {civilSeconds, plural, who} from './format.js';
import {sourceLink} from './links.js';
import {acknowledge, acknowledgeLine, may, pressable} from './operate.js';
import {Headline, Problem, section} from './parts.js';
import {session} from './session.js';
import {zoneName} from './zone.js';

const order = {high: 0, medium: 1, low: 2};
const words = {active: 'active', acknowledged: 'active, acknowledged', returned: 'over, not acknowledged'};

const columns = () => [
  marked('Priority', (alarm) => [unseen(alarm) ? priorityMark[alarm.priority] || 'bad' : 'off', alarm.priority]),
  linked('Source', (alarm) => [alarmSource(alarm), sourceLink(alarm)], 'name own-line'),
  {title: `Since (${zoneName()})`, class: 'time', text: (alarm) => civilSeconds(alarm.raised)},
  aged('Ago', (alarm) => Date.parse(alarm.raised), 'num'),
  {title: 'Alarm', class: 'said', text: (alarm) => alarm.text},
  {title: 'State', class: 'words', text: (alarm) => words[alarm.state] || alarm.state},
  {title: 'Acknowledged by', class: 'words', text: (alarm) => who(alarm.acknowledged_by)},
  {title: 'Acknowledge', class: 'action no-print', make: (cell) => {
    const made = {};
    made.button = pressable('Acknowledge', () => made.seq, (seq) => acknowledge([seq]), {class: 'small'});
    cell.append(made.button);
    return made;
  }, paint: (made, alarm) => {
    made.seq = alarm.seq;
    made.button.hidden = !unseen(alarm);
    made.button.setAttribute('aria-label', `Acknowledge ${alarmSource(alarm)}: ${alarm.text}`);
  }},
];

/** Buttons that acknowledge all alarms of a line, for lines with several. */
function linesPart() {
  const element = h('p', {class: 'controls no-print', hidden: true});
  let signature = '';
  return {element, paint: (waiting) => {
    const counts = new Map();
    for (const {line} of waiting) if (line) counts.set(line, (counts.get(line) || 0) + 1);
    const many = [...counts].filter(([, n]) => n > 1);
    element.hidden = !many.length || !may('acknowledge');
    if (signature === many.join()) return;
    signature = many.join();
    element.replaceChildren(...many.map(([line, n]) =>
      h('button', {type: 'button', onclick: () => acknowledgeLine(line)}, `Acknowledge all ${n} of ${line}`)));
  }};
}

export function alarms(root, _, parameters) {
  const headline = new Headline('Alarms and events');
  const problem = new Problem();
  const table = new DataTable({columns: may('acknowledge') ? columns() : columns().slice(0, -1), key: (a) => `${a.seq} ${a.name}`,
    caption: 'Alarms', empty: 'No alarms.', rowClass: (a) => `alarm-${unseen(a) ? a.priority : 'seen'}`});
  const lines = linesPart();
  const events = session.events ? eventsPart(parameters)
    : {element: h('p', {class: 'empty'}, 'This gateway records no events: add `events:` to its configuration.'), end: () => {}};
  root.append(headline.element, problem.element, section('Alarms', lines.element, table.element),
      section('Events', events.element));
  const refresh = () => allAlarms().then((list) => {
    const waiting = list.filter(unseen);
    headline.paint(waiting.some((a) => a.priority === 'high') ? 'bad' : waiting.length ? 'warn' : 'fine',
        waiting.length ? `${plural(waiting.length, 'alarm')} to acknowledge` : 'No alarms to acknowledge');
    problem.paint(null);
    lines.paint(waiting);
    table.paint(list.sort((a, b) => unseen(b) - unseen(a) || (a.state === 'returned') - (b.state === 'returned')
      || order[a.priority] - order[b.priority] || b.seq - a.seq));
  }, (error) => problem.paint(error));
  refresh();
  const ends = [on('alarms', refresh), on('acted', refresh), events.end];
  return () => ends.forEach((end) => end());
}
