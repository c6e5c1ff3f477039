// SPDX-License-Identifier: Apache-2.0
// The alarm bar of every view: the worst alarm that is not acknowledged, and the number of alarms. The title and the icon of
// the page have this number as well.
import {get} from './api.js';
import {emit, on} from './bus.js';
import {age, setAge} from './clock.js';
import {h, mark, setClass, setMark, setText} from './dom.js';
import {plural} from './format.js';
import {sourceLink} from './links.js';
import {acknowledge, may, pressable} from './operate.js';

export const priorityMark = {high: 'bad', medium: 'warn', low: 'info'};

export const alarmSource = (alarm) => [alarm.line, alarm.device, alarm.point].filter(Boolean).join('.') || 'gateway';

/** True if nobody has acknowledged the alarm. */
export const unseen = (alarm) => alarm.unacknowledged ?? alarm.state !== 'acknowledged';

/** Fetches all alarms that are not normal. */
export async function allAlarms() {
  const records = [];
  for (let after = 0, more = true; more;) {
    const page = await get('alarms', {after});
    records.push(...page.records);
    more = page.more && page.next > after;
    after = page.next;
  }
  return records;
}

const iconMost = 9;

export function startAlarmBar(bar) {
  const shape = mark('fine');
  const total = h('a', {href: '#/alarms', class: 'alarm-count'});
  const priority = h('strong');
  const source = h('a', {class: 'alarm-source'});
  const text = h('span', {class: 'alarm-text'});
  const since = age();
  let shown = null;
  const button = pressable('Acknowledge', () => shown, (alarm) => alarm && acknowledge([alarm.seq]));
  const worst = h('span', {class: 'alarm-worst'}, priority, since, source, text);
  // A screen reader reads `spoken`, which does not contain the age, because the age changes every second.
  const spoken = h('span', {class: 'hidden', role: 'status'});
  bar.append(shape, worst, total, button, spoken);

  on('alarms', ({active, unacknowledged, worst: first}) => {
    const alarm = first && unseen(first) ? first : null;
    shown = alarm;
    bar.hidden = false;
    setText(total, active || unacknowledged ? (unacknowledged ? `${plural(unacknowledged, 'alarm')} to acknowledge`
      : `${plural(active, 'alarm')}, all acknowledged`) : 'No alarms');
    setMark(shape, alarm ? priorityMark[alarm.priority] || 'bad' : active ? 'info' : 'fine');
    setClass(bar, `alarm-bar ${alarm ? alarm.priority : 'quiet'}`);
    document.getElementById('icon').href = unacknowledged ? `favicon-${Math.min(iconMost, unacknowledged)}.svg` : 'favicon.svg';
    emit('unacknowledged', unacknowledged);
    worst.hidden = !alarm;
    button.hidden = !alarm || !may('acknowledge');
    if (!alarm) return setText(spoken, '');
    setText(priority, `${alarm.priority}${alarm.state === 'returned' ? ', over' : ''}`);
    setText(source, alarmSource(alarm));
    source.href = sourceLink(alarm);
    setText(text, alarm.text);
    text.title = alarm.text;
    setText(spoken, `Alarm, ${alarm.priority}: ${alarmSource(alarm)}: ${alarm.text}`);
    setAge(since, Date.parse(alarm.raised));
    button.setAttribute('aria-label', `Acknowledge ${alarmSource(alarm)}: ${alarm.text}`);
  });
}
