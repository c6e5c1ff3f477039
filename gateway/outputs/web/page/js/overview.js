// SPDX-License-Identifier: Apache-2.0
// The first view: one list of problems, worst first, then what is in maintenance, then the lines that work.
import {allAlarms} from './alarm_bar.js';
import {on} from './bus.js';
import {age, now, setAge} from './clock.js';
import {linked} from './columns.js';
import {DataTable} from './data_table.js';
import {h, mark, setMark, setText} from './dom.js';
import {civilSeconds, count, plural, shareText} from './format.js';
import {deviceLink, lineLink} from './links.js';
import {acknowledge, confirmTrial, endLoan, may, pressable, revertTrial, setInUse} from './operate.js';
import {Headline, Problem, section} from './parts.js';
import {inMaintenance, maintenanceOf, problemsOf} from './problems.js';
import {watchStatus} from './status.js';

const shapes = {high: 'bad', medium: 'warn', low: 'info', hint: 'off'};
const shapeOf = (one) => (one.over ? 'off' : shapes[one.priority]);

function rank(made, one) {
  setMark(made.shape, shapeOf(one));
  setText(made.word, one.priority);
}

function paintProblem(made, one) {
  setText(made.subject, one.subject);
  made.subject.href = one.href;
  setText(made.word, [one.word, one.over ? 'over, not acknowledged' : ''].filter(Boolean).join(', '));
  setText(made.cause, [one.cause, one.with].filter(Boolean).join('; '));
  setText(made.remedy, one.remedy);
  setText(made.more, one.more.join('\n'));
  for (const part of [made.word, made.remedy, made.more]) part.hidden = !part.textContent;
}

const problemColumns = [
  {title: 'Priority', class: 'prio', make: (cell) => {
    const made = {shape: mark('bad'), word: h('span')};
    cell.append(h('span', {class: 'marked'}, made.shape, made.word));
    return made;
  }, paint: rank},
  {title: 'Problem', class: 'trouble', make: (cell) => {
    const made = {subject: h('a'), word: h('span', {class: 'word'}), cause: h('span', {class: 'cause'}),
      remedy: h('span', {class: 'remedy'}), more: h('span', {class: 'more'})};
    cell.append(h('span', {class: 'subject'}, made.subject, made.word), made.cause, made.remedy, made.more);
    return made;
  }, paint: paintProblem},
  {title: 'Since', class: 'since', make: (cell) => cell.appendChild(age()), paint: (element, one) => {
    setAge(element, one.since, '');
    element.title = one.since === null ? '' : civilSeconds(Math.round(one.since));
  }},
  {title: 'Acknowledge', class: 'action no-print', make: (cell) => {
    const made = {numbers: []};
    made.button = pressable('Acknowledge', () => made.numbers, acknowledge, {class: 'small'});
    cell.append(made.button);
    return made;
  }, paint: (made, one) => {
    made.numbers = one.waiting;
    made.button.hidden = !one.waiting.length || !may('acknowledge');
    made.button.setAttribute('aria-label', `Acknowledge ${one.subject}: ${one.cause}`);
  }},
];

const maintenanceColumns = [
  linked('What', (one) => [one.subject, one.href]),
  {title: 'Why', class: 'said', text: (one) => one.text + (one.until ? ` until ${civilSeconds(one.until)}` : '')},
  {title: 'Act', class: 'action no-print', make: (cell) => {
    const made = {};
    made.button = pressable('', () => made.one, (one) => (one.line ? endLoan(one.line) : setInUse(one.device, true)), {class: 'small'});
    cell.append(made.button);
    return made;
  }, paint: (made, one) => {
    made.one = one;
    setText(made.button, one.line ? 'End the loan' : 'Enable');
    made.button.setAttribute('aria-label', `${made.button.textContent}: ${one.subject}`);
    made.button.hidden = !may(one.line ? 'release' : 'disable');
  }},
];

const lineColumns = [
  linked('Line', (line) => [line.name, lineLink(line.name)]),
  {title: 'Devices that work', class: 'chips', make: (cell) => {
    const made = {list: h('span', {class: 'chip-list'}), note: h('span', {class: 'about'}), signature: ''};
    cell.append(made.list, made.note);
    return made;
  }, paint: (made, line) => {
    const names = line.well.map((d) => d.name);
    if (made.signature !== names.join()) {
      made.signature = names.join();
      made.list.replaceChildren(...names.map((name) => h('a', {href: deviceLink({line: line.name, device: name})}, name)));
    }
    const others = line.devices.length - line.well.length;
    setText(made.note, !line.devices.length ? 'routes only' : !others ? '' : names.length ? `and ${count(others)} above` : 'none: see above');
  }},
  {title: 'Use', class: 'num', text: (line) => line.useText},
  {title: 'Good values', class: 'num words', text: (line) => {
    const [good, all] = line.devices.reduce(([a, b], d) => [a + (d.points.good || 0), b + (d.points.count || 0)], [0, 0]);
    return all ? `${count(good)} of ${count(all)}` : '–';
  }},
];

function health(status, list) {
  const devices = status.lines.flatMap((line) => line.devices.map((device) => ({device, line})));
  const active = devices.filter(({device, line}) => !inMaintenance(device, line));
  const silent = active.filter(({device}) => device.state === 'offline' || device.state === 'never seen').length;
  const rest = devices.length - active.length;
  const said = [
    list.length && plural(list.length, 'problem'),
    silent && `${count(silent)} of ${plural(active.length, 'device')} ${silent === 1 ? 'does' : 'do'} not answer`,
    !silent && active.length && `${plural(active.length, 'device')} ${active.length === 1 ? 'answers' : 'answer'}`,
    rest && `${count(rest)} in maintenance`,
  ].filter(Boolean);
  if (!devices.length && !list.length) return ['info', 'There are no devices in the configuration'];
  const kind = list.some((one) => one.kind === 'bad' && !one.over) ? 'bad' : list.length ? 'warn' : 'fine';
  return [kind, `${list.length ? '' : 'All is well: '}${said.join(', ')}`];
}

/** Minutes and seconds: "4:35". */
function countdown(ms) {
  const s = Math.max(0, Math.ceil(ms / 1000));
  return `${Math.floor(s / 60)}:${String(s % 60).padStart(2, '0')}`;
}

/** The trial of a configuration, with the time that is left. */
export function trialPart() {
  const left = h('strong');
  let applied = '';
  const buttons = [pressable('Confirm', () => applied, confirmTrial), pressable('Take back', () => applied, revertTrial)];
  const element = h('p', {class: 'trial', hidden: true}, mark('warn'), h('span', {}, 'This configuration is on trial. The previous one comes back in ',
      left, ' unless somebody confirms this one', may('confirm') ? '.' : ' (`baudgate confirm`).'), may('confirm') ? buttons : null);
  let until = null;
  const tick = () => until !== null && setText(left, countdown(until - now()));
  const timer = setInterval(tick, 500);
  return {element, end: () => clearInterval(timer), paint: (configuration) => {
    until = configuration?.confirm_until ? Date.parse(configuration.confirm_until) : null;
    applied = configuration?.applied;
    element.hidden = until === null;
    tick();
  }};
}

export function overview(root) {
  const headline = new Headline('Overview');
  const failure = new Problem();
  const trial = trialPart();
  const problems = new DataTable({columns: problemColumns, key: (one) => one.key, caption: 'Problems, worst first', empty: 'No problems.',
    rowClass: (one) => `problem-row rank-${shapeOf(one)}`});
  const maintenance = new DataTable({columns: maintenanceColumns, key: (one) => one.key, caption: 'In maintenance'});
  const lines = new DataTable({columns: lineColumns, key: (line) => line.name, caption: 'Lines', empty: 'There are no lines.'});
  const maintained = section('In maintenance', maintenance.element);
  const working = section('Lines', lines.element);
  maintained.hidden = true;
  root.append(headline.element, failure.element, trial.element, h('div', {class: 'problems'}, problems.element), maintained, working);
  let status = null;
  let alarms = [];
  const paint = () => {
    if (!status) return;
    const list = problemsOf(status, alarms);
    // A device with a mere hint works.
    const marred = new Set(list.filter((one) => one.key.startsWith('device ') && one.kind !== 'info').map((one) => one.subject));
    failure.paint(null);
    headline.paint(...health(status, list));
    trial.paint(status.configuration);
    problems.paint(list);
    const out = maintenanceOf(status);
    maintained.hidden = !out.length;
    maintenance.paint(out);
    lines.paint(status.lines.map((line) => ({...line,
      useText: shareText(line, line.use, status.uptime_ms),
      well: line.devices.filter((d) => !inMaintenance(d, line) && !marred.has(`${line.name}.${d.name}`)
        && d.state !== 'offline' && d.state !== 'never seen')})));
  };
  const refresh = () => allAlarms().then((list) => {
    alarms = list;
    paint();
  }, () => {});
  refresh();
  const ends = [trial.end, on('alarms', refresh), on('acted', refresh), watchStatus('', (found) => {
    status = found;
    paint();
  }, (error) => failure.paint(error))];
  return () => ends.forEach((end) => end());
}
