// SPDX-License-Identifier: Apache-2.0
// The view of alarms: a live list of alarms that are not normal, and the events by device, time and state.
import {get} from './api.js';
import {acknowledge, alarmSource, priorityMark} from './alarm_bar.js';
import {on} from './bus.js';
import {aged, linked, marked, pressed} from './columns.js';
import {DataTable} from './data_table.js';
import {eventsPart} from './events.js';
import {civilSeconds, plural} from './format.js';
import {sourceLink} from './links.js';
import {Headline, Problem, section} from './parts.js';
import {session} from './session.js';

const order = {high: 0, medium: 1, low: 2};
const unseen = (alarm) => alarm.state !== 'acknowledged';
const words = {active: 'active', acknowledged: 'active, acknowledged', returned: 'no longer active, not acknowledged'};

const columns = [
  marked('Priority', (alarm) => [unseen(alarm) ? priorityMark[alarm.priority] || 'bad' : 'off', alarm.priority]),
  {title: 'State', class: 'words', text: (alarm) => words[alarm.state] || alarm.state},
  linked('Source', (alarm) => [alarmSource(alarm), sourceLink(alarm)], 'name own-line'),
  {title: 'Alarm', class: 'said', text: (alarm) => alarm.text},
  {title: 'Raised', class: 'time', text: (alarm) => civilSeconds(alarm.raised)},
  aged('Ago', (alarm) => Date.parse(alarm.raised), 'num words'),
  {title: 'Acknowledged by', class: 'words', text: (alarm) => alarm.acknowledged_by || '–'},
  pressed('Acknowledge', 'Acknowledge', acknowledge, (alarm) => ({value: alarm.seq,
    hidden: !unseen(alarm) || !session.acknowledge, label: `Acknowledge ${alarmSource(alarm)}: ${alarm.text}`})),
];

async function allAlarms() {
  const records = [];
  for (let after = 0, more = true; more;) {
    const page = await get('alarms', {after});
    records.push(...page.records);
    more = page.more && page.next > after;
    after = page.next;
  }
  return records.sort((a, b) => unseen(b) - unseen(a) || order[a.priority] - order[b.priority] || b.seq - a.seq);
}

export function alarms(root, _, parameters) {
  const headline = new Headline('Alarms and events');
  const problem = new Problem();
  const table = new DataTable({columns: session.acknowledge ? columns : columns.slice(0, -1), key: (a) => `${a.seq} ${a.name}`,
    caption: 'Alarms', empty: 'No alarms.', rowClass: (a) => `alarm-${unseen(a) ? a.priority : 'seen'}`});
  if (!session.events) {
    headline.paint('info', 'This gateway records no events or alarms: add `events:` to its configuration');
    root.append(headline.element);
    return () => {};
  }
  const events = eventsPart(parameters);
  root.append(headline.element, problem.element, section('Alarms', table.element), section('Events', events.element));
  const refresh = () => allAlarms().then((list) => {
    const waiting = list.filter(unseen).length;
    headline.paint(list.some((a) => unseen(a) && a.priority === 'high') ? 'bad' : waiting ? 'warn' : 'fine',
        waiting ? `${plural(waiting, 'alarm')} to acknowledge` : 'No alarms to acknowledge');
    problem.paint(null);
    table.paint(list);
  }, (error) => problem.paint(error));
  refresh();
  const ends = [on('alarms', refresh), on('acknowledged', refresh), events.end];
  return () => ends.forEach((end) => end());
}
