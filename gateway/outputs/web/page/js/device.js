// SPDX-License-Identifier: Apache-2.0
// The view of one device: its values first; its communication and its register map are folded.
import {get} from './api.js';
import {allAlarms, priorityMark, unseen} from './alarm_bar.js';
import {on} from './bus.js';
import {age, now, setAge} from './clock.js';
import {DataTable} from './data_table.js';
import {h, setText} from './dom.js';
import {exchangeColumns, exchangesOf} from './exchanges.js';
import {count, deviceAdvice, deviceTrouble, inWords, micros, named, okShare, percent, stateWord} from './format.js';
import {histogram} from './histogram.js';
import {alarmsLink, lineLink, trendsLink} from './links.js';
import {acknowledge, may, setInUse} from './operate.js';
import {crumbs, Facts, folded, Headline, HourStrip, Problem, section, Sentences} from './parts.js';
import {PointTable} from './point_table.js';
import {disabledText, inMaintenance} from './problems.js';
import {repeat, watchStatus} from './status.js';
import {kindOf, matching, pointsOf, valueOf} from './store.js';

const shownExchanges = 20;

const groups = {fast: 'Read fast', own: 'Read with a period of its own', slow: 'Read slowly', daily: 'Read daily', once: 'Read once',
  write: 'Write only'};
const groupOf = (point) => (point.write_only ? 'write' : point.group);

/** Puts the groups of the profile one after the other, each below its heading. */
function grouped(points) {
  const found = Object.keys(groups).map((key) => [groups[key], points.filter((point) => groupOf(point) === key)]).filter(([, some]) => some.length);
  const rest = points.filter((point) => !groups[groupOf(point)]);
  if (found.length < 2) return points;
  return [...rest, ...found.flatMap(([heading, some]) => [{heading}, ...some])];
}

function pointsPart(name, sought, problem) {
  const table = new PointTable({full: false, label: `Points of ${name}`});
  const filter = h('input', {type: 'search', id: 'filter', placeholder: 'Filter', oninput: () => paint()});
  const marred = h('input', {type: 'checkbox', id: 'marred', onchange: () => paint()});
  const trend = h('a', {class: 'button', hidden: true});
  let points = [];
  const paint = () => table.paint(grouped(matching(points, filter.value)
      .filter((p) => !marred.checked || ['bad', 'uncertain'].includes(kindOf(p, valueOf(p.id))))));
  const fetchPoints = () => pointsOf(name).then((found) => {
    points = found;
    problem.paint(null, 'points');
    const kept = points.filter((point) => point.kept).slice(0, 8).map((point) => point.name);
    trend.hidden = !kept.length;
    trend.href = trendsLink({points: kept.join(), range: '1h'});
    setText(trend, kept.length === 1 ? 'Trend' : `Trend of the first ${kept.length}`);
    paint();
    if (sought) table.reveal(sought);
    sought = '';
  }, (error) => problem.paint(error, 'points'));
  const end = on('points', fetchPoints);
  fetchPoints();
  const controls = h('div', {class: 'controls no-print'},
      h('label', {class: 'hidden', for: 'filter'}, 'Filter the points'), filter,
      h('label', {class: 'check'}, marred, 'Only values that are not good'), trend);
  return {element: section('Values', controls, table.element), end: () => {
    end();
    table.end();
  }};
}

const codes = (list) => (list ? (list.length ? list.join(', ') : '–') : null);

const mapColumns = [
  {title: 'Point', class: 'name', text: (r) => r.point},
  {title: 'Table', text: (r) => r.table},
  {title: 'Address', class: 'num', text: (r) => r.address},
  {title: 'PLC', class: 'num', text: (r) => r.plc ?? '–'},
  {title: 'Registers', class: 'num', text: (r) => r.count},
  {title: 'Read with', text: (r) => codes(r.read_functions) ?? '–'},
  {title: 'Write with', text: (r) => codes(r.write_functions) ?? '–'},
  {title: 'Type', text: (r) => r.type},
  {title: 'Unit', text: (r) => r.unit || '–'},
  {title: 'Access', text: (r) => inWords(r.access.replace('_', ', '))},
];

function mapPart(name) {
  const table = new DataTable({columns: mapColumns, key: (r) => `${r.table} ${r.address} ${r.point}`,
    caption: `Registers of ${name}`, empty: 'No point of this device is on Modbus.'});
  const unit = h('p');
  const problem = new Problem();
  let asked = null;
  const fetchMap = () => (asked ||= get('map', {device: name}).then((map) => {
    unit.textContent = map.unit === null ? 'Not on Modbus.'
      : `Modbus unit ${map.unit}. Register N + 20000 has the quality of the value in register N, register N + 40000 its age in tenths of a second.`;
    table.paint(map.registers);
  }, (error) => {
    asked = null;
    problem.paint(error);
  }));
  const print = h('button', {type: 'button', class: 'no-print', onclick: async () => {
    await fetchMap();
    document.body.classList.add('print-map');
    window.print();
    document.body.classList.remove('print-map');
  }}, 'Print');
  const details = folded('Register map', problem.element, unit, print, table.element);
  details.classList.add('map');
  details.addEventListener('toggle', () => details.open && fetchMap());
  return details;
}

function facts(device, labels, answered, strip) {
  const {outcomes, hour} = device;
  strip.paint(hour);
  setAge(answered, device.age_ms === null ? null : now() - device.age_ms);
  const failed = Object.entries(outcomes).filter(([name, n]) => name !== 'ok' && n > 0);
  return [
    [device.unasked ? 'Last message' : 'Answered', answered],
    ['Last exchange', inWords(device.last_outcome)],
    [device.unasked ? 'Messages' : 'Exchanges', count(device.exchanges)],
    ['OK', percent(okShare(device))],
    ['Exchanges not OK', failed.map(([name, n]) => `${inWords(name)} ${count(n)}`).join(', ') || 'none'],
    ['Last hour', strip.element],
    ['Outages, last hour', count(hour.outages)],
    ...named(labels).map(([title, text]) => [title, text(device)]),
    ['Round trip', `mean ${micros(device.round_trips.mean_us)}, 99 % ${micros(device.round_trips.p99_us)}`],
    ['Points', `${device.points.good} good, ${device.points.uncertain} uncertain, ${device.points.bad} bad`],
    ['Learned', device.learned || 'as configured'],
  ];
}

/** Alarms of the gateway itself whose reason is in the sentences about the device. */
const saidByAdvice = ['no answer', 'wrong device', 'another device'];

/** The alarms of the device, and the buttons of people who may operate the device. */
function actions(name) {
  let use = true;
  let waiting = [];
  const toggle = h('button', {type: 'button', hidden: true, onclick: () => setInUse(name, !use)});
  const seen = h('button', {type: 'button', hidden: true, onclick: () => acknowledge(waiting)});
  const list = new Sentences();
  const refresh = () => allAlarms().then((alarms) => {
    const mine = alarms.filter((alarm) => `${alarm.line}.${alarm.device}` === name);
    waiting = mine.filter(unseen).map((alarm) => alarm.seq);
    list.paint(mine.filter((alarm) => !saidByAdvice.includes(alarm.name)).map((alarm) => ({kind: alarm.state === 'returned' ? 'info'
      : priorityMark[alarm.priority], from: `Alarm, ${alarm.priority}`, text: `${alarm.raised}: ${alarm.text}${alarm.state === 'returned' ? ', over' : ''}`})));
    seen.hidden = !waiting.length || !may('acknowledge');
    setText(seen, waiting.length === 1 ? 'Acknowledge its alarm' : `Acknowledge its ${waiting.length} alarms`);
  }, () => {});
  refresh();
  return {list: list.element, elements: [seen, toggle], ends: [on('alarms', refresh), on('acted', refresh)], paint: (device) => {
    use = device.state !== 'disabled';
    toggle.hidden = !may('disable');
    setText(toggle, use ? 'Disable …' : 'Enable …');
  }};
}

export function device(root, name, parameters) {
  const line = name.split('.')[0];
  const short = name.slice(line.length + 1);
  const headline = new Headline(name);
  const about = h('p', {class: 'about'});
  const problem = new Problem();
  const advice = new Sentences();
  const figures = new Facts();
  const answered = age();
  const strip = new HourStrip();
  const chart = histogram();
  const points = pointsPart(name, parameters.point, problem);
  const acts = actions(name);
  const exchanges = new DataTable({columns: exchangeColumns(false), key: (e) => e.key,
    caption: `Last exchanges of ${name}`, empty: 'No exchange yet.'});
  const communication = folded('Communication', figures.element, h('h3', {}, 'Last exchanges'), exchanges.element,
      h('h3', {}, 'Round trips'), chart.element);
  const known = h('div', {}, acts.list, advice.element,
      h('p', {class: 'controls no-print'}, h('a', {href: alarmsLink({device: name})}, 'Events of this device'), acts.elements),
      points.element, communication, mapPart(name));
  root.append(crumbs(['Overview', '#/overview'], [line, lineLink(line)]), headline.element, about, problem.element, known);
  const ends = [points.end, ...acts.ends,
    watchStatus(name, (status) => {
      const mine = status.lines[0].devices[0];
      const resting = inMaintenance(mine, status.lines[0]);
      problem.paint(null);
      known.hidden = false;
      headline.paint(resting ? 'off' : deviceTrouble(mine).shape, `${name}: ${stateWord(mine)}`);
      setText(about, `${mine.protocol}, address ${mine.address}, profile ${mine.profile}`
        + (mine.unit === null ? ', not on Modbus' : `, Modbus unit ${mine.unit}`));
      advice.paint([...(mine.trouble ? [{kind: 'bad', text: mine.trouble}] : []),
        ...(mine.disabled ? [disabledText(mine)] : deviceAdvice(status.lines[0], mine)).map((text) => ({kind: resting ? 'off' : text.startsWith('note:') ? 'info' : 'warn', text}))]);
      acts.paint(mine);
      figures.paint(facts(mine, status.labels.device, answered, strip));
      chart.paint(mine.round_trips);
    }, (error) => {
      problem.paint(error);
      known.hidden = error.status === 404;
    }),
    repeat(() => (communication.open ? get('recorded', {line, device: short}) : Promise.resolve(null)), (answer) => {
      if (answer) exchanges.paint(exchangesOf(answer.records).slice(-shownExchanges).reverse());
    }, () => {}, 1500),
  ];
  return () => ends.forEach((end) => end());
}
