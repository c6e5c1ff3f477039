// SPDX-License-Identifier: Apache-2.0
// The view of one device: its points, counters, round trips, last exchanges and register map.
import {get} from './api.js';
import {on} from './bus.js';
import {age, now, setAge} from './clock.js';
import {DataTable} from './data_table.js';
import {h} from './dom.js';
import {exchangeColumns, exchangesOf} from './exchanges.js';
import {count, deviceAdvice, deviceTrouble, micros, named, okShare, percent, qualityKind} from './format.js';
import {histogram} from './histogram.js';
import {alarmsLink, lineLink} from './links.js';
import {crumbs, Facts, Headline, HourStrip, Problem, section, Sentences} from './parts.js';
import {PointTable} from './point_table.js';
import {repeat, watchStatus} from './status.js';
import {matching, pointsOf, valueOf} from './store.js';

const shownExchanges = 20;

function pointsPart(name, sought) {
  const table = new PointTable({full: false, label: `Points of ${name}`});
  const filter = h('input', {type: 'search', id: 'filter', placeholder: 'Filter', oninput: () => paint()});
  const marred = h('input', {type: 'checkbox', id: 'marred', onchange: () => paint()});
  const problem = new Problem();
  let points = [];
  const paint = () => table.paint(matching(points, filter.value)
      .filter((p) => !marred.checked || qualityKind(valueOf(p.id)?.quality ?? 0) !== 'good'));
  const fetchPoints = () => pointsOf(name).then((found) => {
    points = found;
    problem.paint(null);
    paint();
    if (sought) table.reveal(sought);
    sought = '';
  }, (error) => problem.paint(error));
  const end = on('points', fetchPoints);
  fetchPoints();
  const controls = h('div', {class: 'controls no-print'},
      h('label', {class: 'hidden', for: 'filter'}, 'Filter the points'), filter,
      h('label', {class: 'check'}, marred, 'Only points that are not good'));
  return {element: section('Points', controls, problem.element, table.element), end: () => {
    end();
    table.end();
  }};
}

const mapColumns = [
  {title: 'Point', class: 'name', text: (r) => r.point},
  {title: 'Table', text: (r) => r.table},
  {title: 'Address', class: 'num', text: (r) => r.address},
  {title: 'Registers', class: 'num', text: (r) => r.count},
  {title: 'Type', text: (r) => r.type},
  {title: 'Unit', text: (r) => r.unit},
  {title: 'Access', text: (r) => r.access},
];

function mapPart(name) {
  const table = new DataTable({columns: mapColumns, key: (r) => `${r.table} ${r.address} ${r.point}`,
    caption: `Registers of ${name}`, empty: 'No point of this device is on Modbus.'});
  const unit = h('p');
  const problem = new Problem();
  const details = h('details', {class: 'map'}, h('summary', {}, 'Register map'), problem.element, unit, table.element);
  let asked = null;
  const fetchMap = () => (asked ||= get('map', {device: name}).then((map) => {
    unit.textContent = map.unit === null ? 'Not on Modbus.'
      : `Modbus unit ${map.unit}. Register N + 20000 has the quality of the value in register N, register N + 40000 its age in tenths of a second.`;
    table.paint(map.registers);
  }, (error) => {
    asked = null;
    problem.paint(error);
  }));
  details.addEventListener('toggle', () => details.open && fetchMap());
  const print = h('button', {type: 'button', class: 'no-print', onclick: async () => {
    await fetchMap();
    details.open = true;
    document.body.classList.add('print-map');
    window.print();
    document.body.classList.remove('print-map');
  }}, 'Print the register map');
  return {element: details, print};
}

function facts(device, labels, answered, strip) {
  const {outcomes, hour} = device;
  strip.paint(hour);
  setAge(answered, device.age_ms === null ? null : now() - device.age_ms);
  const failed = Object.entries(outcomes).filter(([name, n]) => name !== 'ok' && n > 0);
  return [
    ['Answered', answered],
    ['Last exchange', device.last_outcome],
    ['Exchanges', count(device.exchanges)],
    ['OK', percent(okShare(device))],
    ['Exchanges not OK', failed.map(([name, n]) => `${name} ${count(n)}`).join(', ') || 'none'],
    ['Last hour', strip.element],
    ['Outages, last hour', count(hour.outages)],
    ...named(labels).map(([title, text]) => [title, text(device)]),
    ['Round trip', `mean ${micros(device.round_trips.mean_us)}, 99 % ${micros(device.round_trips.p99_us)}`],
    ['Points', `${device.points.good} good, ${device.points.uncertain} uncertain, ${device.points.bad} bad`],
    ['Learned', device.learned || 'as configured'],
  ];
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
  const points = pointsPart(name, parameters.point);
  const map = mapPart(name);
  const exchanges = new DataTable({columns: exchangeColumns(false), key: (e) => e.key,
    caption: `Last exchanges of ${name}`, empty: 'No exchange yet.'});
  const last = section('Last exchanges', exchanges.element);
  root.append(crumbs(['Overview', '#/overview'], [line, lineLink(line)]), headline.element, about, problem.element,
      advice.element, h('p', {class: 'controls no-print'}, h('a', {href: alarmsLink({device: name})}, 'Events of this device'),
          h('button', {type: 'button', onclick: () => last.scrollIntoView()}, 'Go to the last exchanges'), map.print),
      figures.element, points.element, last,
      section('Round trips', chart.element), map.element);
  const ends = [points.end,
    watchStatus(name, (status) => {
      const mine = status.lines[0].devices[0];
      problem.paint(null);
      headline.paint(deviceTrouble(mine).shape, `${name}: ${mine.state}`);
      about.textContent = `${mine.protocol}, address ${mine.address}, profile ${mine.profile}`
        + (mine.unit === null ? ', not on Modbus' : `, Modbus unit ${mine.unit}`);
      advice.paint([...(mine.trouble ? [{kind: 'bad', text: mine.trouble}] : []), ...deviceAdvice(status.lines[0], mine)]);
      figures.paint(facts(mine, status.labels.device, answered, strip));
      chart.paint(mine.round_trips);
    }, (error) => problem.paint(error)),
    repeat(() => get('recorded', {line, device: short}), ({records}) => {
      exchanges.paint(exchangesOf(records).slice(-shownExchanges).reverse());
    }, () => {}, 3000),
  ];
  return () => ends.forEach((end) => end());
}
