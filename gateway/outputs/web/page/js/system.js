// SPDX-License-Identifier: Apache-2.0
// The system view: Modbus clients and routes, DDS, records, and the running configuration.
import {get} from './api.js';
import {age, now, setAge} from './clock.js';
import {aged, counted, heardAgo, pressed} from './columns.js';
import {DataTable} from './data_table.js';
import {h, setText} from './dom.js';
import {ageText, bytes, civilSeconds, count, inWords, named} from './format.js';
import {act, may} from './operate.js';
import {Facts, Headline, Problem, section, Sentences} from './parts.js';
import {trialPart} from './overview.js';
import {gatewayProblems} from './problems.js';
import {repeat, watchStatus} from './status.js';
import {zoneName} from './zone.js';

const last = aged('Last', heardAgo);

const clientColumns = [
  {title: 'Client', class: 'name', text: (c) => c.peer},
  {title: 'On', text: (c) => c.listener},
  {title: 'Priority', text: (c) => c.priority},
  counted('Requests', (c) => c.requests),
  counted('Exceptions', (c) => c.exceptions),
  counted('Waiting', (c) => c.outstanding),
  {title: 'Bytes in', class: 'num', text: (c) => bytes(c.bytes_in)},
  {title: 'Bytes out', class: 'num', text: (c) => bytes(c.bytes_out)},
  last,
];

const routeColumns = (labels) => [
  {title: 'Units', class: 'name', text: (r) => r.units},
  {title: 'Route to', text: (r) => r.target},
  ...named(labels).map(([title, text]) => ({title, class: 'num', text})),
  {title: 'Last trouble', class: 'said', text: (r) => inWords(r.last_trouble) || '–'},
];

/** Returns a row for a route, then a row for each of its units if clients have addressed more than one. */
const withUnits = (route) => [route, ...(route.by_unit.length < 2 ? [] : route.by_unit.map((unit) =>
  ({...unit, units: `unit ${unit.unit}`, target: route.target, last_trouble: ''})))];

const masterColumns = [
  {title: 'Master on', class: 'name', text: (m) => m.port},
  {title: 'Port', text: (m) => m.port_state},
  counted('Frames', (m) => m.frames),
  counted('Damaged', (m) => m.damaged),
  last,
];

function keptFacts(status) {
  const {events, history, audit} = status;
  const state = (part) => (part ? `${part.state}${part.trouble ? `: ${part.trouble}` : ''}` : 'off');
  return [
    ['Events', events ? `${state(events)}; event numbers ${count(events.oldest)} to ${count(events.newest)}, `
      + `${count(events.left_out)} events left out` : 'off'],
    ['Event file', events ? events.file : '–'],
    ['History', history ? `${state(history)}; ${count(history.points)} points, ${bytes(history.bytes)} of `
      + `${bytes(history.limit)}, ${count(history.dropped)} values dropped` : 'off'],
    ['History folder', history ? history.folder : '–'],
    ['Oldest day', history && history.oldest ? history.oldest.slice(0, 10) : '–'],
    ['Audit', audit ? `${state(audit)}; ${audit.mode.replace('_', ' ')}, ${count(audit.lost)} records lost` : 'off'],
  ];
}

function ddsFacts(dds) {
  if (!dds) return [['State', 'off']];
  return [
    ['State', dds.state],
    ['Domain', dds.domain],
    ['Subscribers', count(dds.subscribers)],
    ['Samples', `${count(dds.samples)} published, ${count(dds.refused)} refused`],
    ['Last message of the DDS process', dds.heard_ms === null ? 'never' : `${ageText(dds.heard_ms)} before this page asked`],
    ['DDS process ended', `${count(dds.times_lost)} times${dds.last_end ? `, last: ${dds.last_end}` : ''}`],
    ['Events', dds.events ? dds.events.text : '–'],
    ['Datagrams', dds.datagrams.text],
    ['Write requests', dds.requests ? dds.requests.text : 'not accepted'],
  ];
}

/** The list of sessions, for the roles that may see it. */
function sessionsPart() {
  const problem = new Problem();
  const table = new DataTable({caption: 'Sessions', key: (s) => s.id, empty: 'Nobody is logged in.', columns: [
    {title: 'User', class: 'name', text: (s) => s.user || 'token'},
    {title: 'Role', text: (s) => s.role || '–'},
    {title: 'From', text: (s) => s.from},
    {title: `Since (${zoneName()})`, class: 'time', text: (s) => civilSeconds(s.since)},
    aged('Last request', (s) => Date.parse(s.last)),
    ...(may('end_sessions') ? [pressed('End', 'End', (id) => act('sessions/end', {id}), (s) => ({value: s.id, label: `End the session of ${s.user || 'the token'}`}))] : []),
  ]});
  const end = repeat(() => get('sessions'), ({sessions}) => {
    problem.paint(null);
    table.paint(sessions);
  }, (error) => problem.paint(error), 10e3);
  return {element: section('Sessions', problem.element, table.element), end};
}

function configurationPart() {
  const figures = new Facts();
  const text = h('pre', {tabindex: '0', role: 'region', 'aria-label': 'Text of the configuration'});
  const trial = trialPart();
  const advice = new Sentences();
  const problem = new Problem();
  const left = age();
  let applied = null;
  const fetchText = () => get('configuration').then((configuration) => {
    problem.paint(null);
    setText(text, configuration.text);
  }, (error) => {
    applied = null;
    problem.paint(error);
  });
  return {
    element: section('Configuration in force', trial.element, advice.element, figures.element, problem.element, text),
    end: trial.end,
    paint(configuration) {
      if (!configuration) {
        figures.paint([['File', 'none: this is the demo']]);
        return;
      }
      if (configuration.applied !== applied) {
        applied = configuration.applied;
        fetchText();
      }
      setAge(left, Date.parse(configuration.applied));
      figures.paint([['File', configuration.file], ['Applied', civilSeconds(configuration.applied)], ['In force since', left],
        ['On trial', configuration.confirm_until ? `until ${civilSeconds(configuration.confirm_until)}` : 'no']]);
      trial.paint(configuration);
      advice.paint([...(configuration.not_the_file ? [configuration.not_the_file] : []), ...configuration.advice]);
    },
  };
}

export function system(root, _, {at}) {
  const headline = new Headline('System');
  const problem = new Problem();
  const advice = new Sentences();
  const figures = new Facts();
  const dds = new Facts();
  const kept = new Facts();
  const clients = new DataTable({columns: clientColumns, key: (c) => `${c.peer} ${c.listener}`, caption: 'Modbus clients',
    empty: 'No Modbus client is connected.'});
  const routesPart = section('Routes');
  // The columns depend on the first status.
  let routes = null;
  const masters = new DataTable({columns: masterColumns, key: (m) => m.port, caption: 'Serial masters',
    empty: 'There are no serial masters.'});
  const configuration = configurationPart();
  const sessions = may('sessions') ? sessionsPart() : null;
  const ddsPart = section('DDS', dds.element);
  const keptPart = section('Records on the disk', kept.element);
  root.append(headline.element, problem.element, advice.element, figures.element, section('Modbus clients', clients.element),
      routesPart, section('Serial masters', masters.element),
      h('div', {class: 'side-by-side'}, ddsPart, keptPart), sessions?.element || '', configuration.element);
  let sought = {routes: routesPart, masters: masters.element, records: keptPart, dds: ddsPart, configuration: configuration.element}[at];
  const end = watchStatus('', (status) => {
    const heard = now();
    problem.paint(null);
    const wrong = gatewayProblems(status);
    advice.paint(wrong.flatMap(({kind, subject, cause, remedy, more}) =>
      [{kind, from: subject, text: [cause, remedy].filter(Boolean).join('. ')}, ...more.map((text) => ({kind, from: subject, text}))]));
    headline.paint(wrong.length ? 'warn' : 'fine', `${status.gateway}: baudgate ${status.version}`);
    figures.paint([['Running for', ageText(status.uptime_ms)], [`Clock of the gateway (${zoneName()})`, civilSeconds(status.time)],
      ['Lines', count(status.lines.length)], ['Devices', count(status.lines.reduce((n, l) => n + l.devices.length, 0))]]);
    clients.paint(status.modbus.clients.map((c) => ({...c, heard})));
    if (!routes) {
      routes = new DataTable({columns: routeColumns(status.modbus.labels.route), key: (r) => `${r.units} ${r.target}`,
        caption: 'Routes', empty: 'There are no routes.'});
      routesPart.append(routes.element);
    }
    routes.paint(status.modbus.routes.flatMap(withUnits));
    masters.paint(status.modbus.masters.map((m) => ({...m, heard})));
    dds.paint(ddsFacts(status.dds));
    kept.paint(keptFacts(status));
    configuration.paint(status.configuration);
    sought?.scrollIntoView();
    sought = null;
  }, (error) => problem.paint(error));
  return () => {
    configuration.end();
    sessions?.end();
    end();
  };
}
