// SPDX-License-Identifier: Apache-2.0
// The alarm bar of every view: the number of alarms, and the newest alarm that is not acknowledged.
import {post} from './api.js';
import {emit, on} from './bus.js';
import {age, setAge} from './clock.js';
import {h, mark, setClass, setMark, setText} from './dom.js';
import {plural} from './format.js';
import {sourceLink} from './links.js';
import {session} from './session.js';

export const priorityMark = {high: 'bad', medium: 'warn', low: 'info'};

export async function acknowledge(target) {
  try {
    const answer = await post('api/v1/alarms/ack', {target});
    if (answer.trouble) emit('notice', answer.trouble);
    emit('acknowledged');
  } catch (error) {
    emit('notice', error.message);
  }
}

export const alarmSource = (alarm) => [alarm.line, alarm.device, alarm.point].filter(Boolean).join('.');

export function startAlarmBar(bar) {
  const shape = mark('fine');
  const total = h('a', {href: '#/alarms', class: 'alarm-count'});
  const priority = h('strong');
  const source = h('a');
  const text = h('span', {class: 'alarm-text'});
  const since = age();
  const button = h('button', {type: 'button', onclick: () => acknowledge(String(button.value))}, 'Acknowledge');
  const newest = h('span', {class: 'alarm-newest'}, priority, source, text, since, button);
  // A screen reader reads `spoken`, which does not contain the age, because the age changes every second.
  const spoken = h('span', {class: 'hidden', role: 'status'});
  bar.append(shape, total, newest, spoken);

  on('alarms', ({active, unacknowledged, newest: latest}) => {
    const alarm = latest && latest.state !== 'acknowledged' ? latest : null;
    bar.hidden = false;
    setText(total, active || unacknowledged
      ? `${plural(active, 'alarm')} active, ${unacknowledged} not acknowledged` : 'No alarms');
    setMark(shape, alarm ? priorityMark[alarm.priority] || 'bad' : active ? 'info' : 'fine');
    setClass(bar, `alarm-bar ${alarm ? alarm.priority : 'quiet'}`);
    newest.hidden = !alarm;
    if (!alarm) return setText(spoken, '');
    setText(priority, `${alarm.priority}${alarm.state === 'returned' ? ', no longer active' : ''}`);
    setText(source, alarmSource(alarm));
    source.href = sourceLink(alarm);
    setText(text, alarm.text);
    setText(spoken, `Alarm, ${alarm.priority}: ${alarmSource(alarm)}: ${alarm.text}`);
    setAge(since, Date.parse(alarm.raised));
    button.value = alarm.seq;
    button.hidden = !session.acknowledge;
  });
}
