// SPDX-License-Identifier: Apache-2.0
// The acts of a user: acknowledge alarms, write points, take devices out of use, end loans, confirm a trial. Without the
// right to an act the page shows no button; the gateway checks each request again.
import {post} from './api.js';
import {emit} from './bus.js';
import {h, setText} from './dom.js';
import {session} from './session.js';
import {valueOf} from './store.js';

/** True if the user has a right: acknowledge, write, disable, release, confirm or writes (reading the audit of writes). */
export const may = (what) => (session.may ? session.may.includes(what) : session[what] === true);

/** Sends a request that acts; the gateway's reason becomes a notice. Returns the answer, or null. */
export async function act(path, body, done) {
  try {
    const answer = await post(`api/v1/${path}`, body);
    const trouble = answer?.trouble;
    if (trouble) emit('notice', trouble);
    emit('acted', done);
    return answer;
  } catch (error) {
    emit('notice', error.message);
    return null;
  }
}

/** Acknowledges exactly these alarms, by their numbers. */
export const acknowledge = (numbers) => act('alarms/ack', {seq: numbers});
export const acknowledgeLine = (line) => act('alarms/ack', {line});

/**
 * A button that acts on what it showed when it was pressed, even if the page changes before it is released.
 * of(button) returns the thing that the button shows.
 */
export function pressable(text, of, use, attributes = {}) {
  let held = null;
  const button = h('button', {type: 'button', ...attributes,
    onpointerdown: () => {
      held = of(button);
    },
    onclick: (event) => {
      const thing = event.detail ? held ?? of(button) : of(button);
      held = null;
      use(thing);
    }}, text);
  return button;
}

/** Asks a question; resolves to true if the user presses the button `yes`. */
function ask(title, content, yes) {
  return new Promise((resolve) => {
    const box = h('dialog', {class: 'ask', 'aria-labelledby': 'ask-title', onclose: () => {
      resolve(box.returnValue === 'yes');
      box.remove();
    }}, h('form', {method: 'dialog'}, h('h2', {id: 'ask-title'}, title), content, h('p', {class: 'buttons'},
        h('button', {value: 'no'}, 'Cancel'), h('button', {value: 'yes', class: 'strong'}, yes))));
    document.body.append(box);
    box.showModal();
  });
}

const rows = (list) => h('dl', {class: 'asked'}, list.map(([title, text]) => [h('dt', {}, title), h('dd', {}, text)]));

export async function setInUse(device, on) {
  const sure = await ask(on ? 'Take the device into use?' : 'Take the device out of use?', [rows([['Device', device]]),
    h('p', {}, on ? 'The gateway polls it again.' : 'The gateway stops polling it; its values become bad (out of service), and it raises no alarms.')],
  on ? 'Enable' : 'Disable');
  const answer = sure && await act(`devices/${on ? 'enable' : 'disable'}`, {device});
  if (answer && answer.enabled !== answer.in_use) emit('notice', `${device}: this lasts until the next restart, because the configuration says otherwise.`);
}

export async function endLoan(line) {
  const sure = await ask('End the loan of the port?', [rows([['Line', line]]),
    h('p', {}, 'The program that has the port loses it, and the gateway polls the line again.')], 'End the loan');
  if (sure) await act('lines/release', {line});
}

/** `applied` names the configuration that the person has seen: another one is neither confirmed nor taken back. */
export const confirmTrial = (applied) => act('reload/confirm', {applied});

export async function revertTrial(applied) {
  if (await ask('Take the configuration back?', h('p', {}, 'The previous configuration is in force again at once.'), 'Take back')) {
    await act('reload/revert', {applied});
  }
}

const results = {
  ok: 'Done.',
  differs: 'The device has another value now.',
  refused: 'The device refuses it.',
  busy: 'Busy: nothing was changed. Try again later.',
  unknown: 'Not known whether it was done: it was sent, and no good answer came. Look at the value before you try again.',
  not_sent: 'Nothing was sent to the device.',
  denied: 'Not permitted: nothing was sent to the device.',
};

function resultText({end, reason, read_back: readBack}) {
  const said = end === 'ok' ? `Done, and ${readBack ? 'read back from the device.' : 'not read back.'}` : results[end] || end;
  return reason ? `${said} (${reason})` : said;
}

const withUnit = (text, point) => [text, point.unit].filter(Boolean).join(' ');
const statesOf = (point) => point.states || (point.type === 'bool' ? {0: 'off', 1: 'on'} : null);

/** The value as the user reads it; `live` is a value of the store. */
function textOf(point, value, live = null) {
  if (value === null || value === undefined) return 'none';
  return withUnit(live?.shown || (statesOf(point)?.[Number(value)] ?? String(value)), point);
}

function field(point, value) {
  const states = statesOf(point);
  if (states) {
    return h('select', {id: 'new-value', required: true}, h('option', {value: ''}, '–'),
        Object.entries(states).map(([key, text]) => h('option', {value: key}, text === key ? key : `${text} (${key})`)));
  }
  if (point.type.startsWith('string')) return h('input', {id: 'new-value', type: 'text', required: true, value: value ?? ''});
  return h('input', {id: 'new-value', type: 'number', required: true, min: point.min, max: point.max, step: 'any', value: value ?? ''});
}

/** An integer that a JavaScript number cannot represent is sent as text. */
function typed(point, text) {
  if (point.type === 'bool') return text === '1';
  if (point.type.startsWith('string')) return text;
  return point.type.includes('int') && !Number.isSafeInteger(Number(text)) ? text.trim() : Number(text);
}

/** The value that the person has seen. The page has a long integer exactly only as its text. */
function seenOf(point) {
  const live = valueOf(point.id);
  const value = live?.value ?? null;
  return typeof value === 'number' && point.type.includes('int') && Number.isInteger(value) && !Number.isSafeInteger(value) ? live.shown : value;
}

/** Asks for a new value, then repeats device, point, old and new value, then writes and shows the result in words. */
export function write(point) {
  const title = h('h2', {id: 'ask-title'});
  const content = h('div');
  const result = h('p', {class: 'result', role: 'alert', hidden: true});
  const back = h('button', {type: 'button', onclick: () => first()});
  const go = h('button', {type: 'submit', class: 'strong'});
  const close = h('button', {type: 'button', onclick: () => box.close()}, 'Cancel');
  const box = h('dialog', {class: 'ask', 'aria-labelledby': 'ask-title', onclose: () => box.remove()},
      h('form', {onsubmit: (event) => {
        event.preventDefault();
        step();
      }}, title, content, result, h('p', {class: 'buttons'}, close, back, go)));
  const device = `${point.line}.${point.device}`;
  const seen = () => seenOf(point);
  const limits = [['min', 'at least'], ['max', 'at most'], ['step', 'in steps of']].filter(([key]) => point[key] !== undefined)
      .map(([key, text]) => `${text} ${point[key]}`).join(', ');
  const input = field(point, point.write_only ? null : seen());
  let step = null;

  function first() {
    setText(title, `Write ${point.point}`);
    content.replaceChildren(rows([['Device', device], ['Point', [point.point, point.description].filter(Boolean).join(': ')],
      ...(point.write_only ? [] : [['Now', textOf(point, seen(), valueOf(point.id))]]), ...(limits ? [['Allowed', limits]] : [])]),
    h('label', {for: 'new-value'}, withUnit('New value', {unit: point.unit && `in ${point.unit}`})), input);
    result.hidden = back.hidden = true;
    go.hidden = false;
    setText(go, 'Continue …');
    setText(close, 'Cancel');
    step = second;
    input.focus();
  }

  function second() {
    const value = typed(point, input.value);
    const expect = seen();
    // Rounded, the old and the new value could look the same, so the exact value follows in brackets.
    const now = valueOf(point.id);
    const exact = typeof expect === 'number' && !statesOf(point) && Number(now?.shown) !== expect ? ` (${expect})` : '';
    const old = textOf(point, expect, now) + exact;
    const sure = h('input', {type: 'checkbox', required: true});
    setText(title, 'Write this to the device?');
    content.replaceChildren(rows([['Device', device], ['Point', point.point],
      ...(point.write_only ? [] : [['Old value', old]]), ['New value', textOf(point, value)]]),
    point.select ? h('label', {class: 'check'}, sure, 'Select it: this point trips or resets something') : '');
    result.hidden = true;
    back.hidden = false;
    setText(back, 'Back');
    setText(go, 'Write');
    step = () => send({value, ...(point.select ? {confirm: true} : {}), ...(point.write_only ? {} : {expect})});
    (point.select ? sure : go).focus();
  }

  async function send(body) {
    go.disabled = true;
    const answer = await post('api/v1/write', {point: point.name, ...body}).catch((error) => ({said: error.message}));
    go.disabled = false;
    setText(result, answer.said || (answer.needs === 'expect' ? `${answer.reason}. Nothing was sent: look at it again.`
      : resultText(answer)));
    result.hidden = false;
    result.className = `result ${answer.end === 'ok' ? 'fine' : 'bad'}`;
    setText(back, 'Another value');
    setText(close, 'Close');
    go.hidden = true;
    close.focus();
  }

  document.body.append(box);
  first();
  box.showModal();
  input.focus();
}
