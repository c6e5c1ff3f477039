// SPDX-License-Identifier: Apache-2.0
// The view of one line: its port, the use of the wire, its devices, and its bytes.
import {allAlarms, unseen} from './alarm_bar.js';
import {get} from './api.js';
import {on} from './bus.js';
import {now} from './clock.js';
import {aged, barred, counted, heardAgo, linked, marked, said} from './columns.js';
import {DataTable} from './data_table.js';
import {h, setText} from './dom.js';
import {exchangeColumns, exchangesOf} from './exchanges.js';
import {ageText, bytes, civilSeconds, count, deviceTrouble, inWords, lineState, lineTrouble, micros, named, okShare, percent, shareText,
  stateWord} from './format.js';
import {histogram} from './histogram.js';
import {alarmsLink, deviceLink} from './links.js';
import {acknowledgeLine, endLoan, may} from './operate.js';
import {crumbs, Facts, folded, Headline, Problem, section, Sentences} from './parts.js';
import {inMaintenance} from './problems.js';
import {watchStatus} from './status.js';
import {liveTrace} from './trace.js';
import {WireUse, minuteOf} from './wire_use.js';

function controlLines(modem) {
  if (!modem) return [];
  const on = Object.entries(modem).filter(([, is]) => is).map(([name]) => name.toUpperCase());
  return [['Control lines on', on.join(' ') || 'none']];
}

function visit(v) {
  return `${v.client}, ${bytes(v.to_port)} to the port, ${bytes(v.from_port)} from it`;
}

function service(s) {
  const who = s.client ? `${visit(s.client)}, since ${civilSeconds(s.client.since)}`
    : s.last ? `none; last client: ${visit(s.last)}, until ${civilSeconds(s.last.until)}: ${s.last.why}` : 'none';
  return [`Clients at ${s.at} (${s.mode})`, s.trouble || who];
}

function facts(line, labels, uptime) {
  const failed = Object.entries(line.outcomes).filter(([name, n]) => name !== 'ok' && n > 0);
  return [
    ['Port', line.port_text],
    ['Port state since', civilSeconds(line.port_since)],
    ['Times the port was lost', count(line.times_lost)],
    ['Use, last minute', shareText(line, line.use, uptime)],
    ['Exchanges', count(line.exchanges)],
    ['Exchanges not OK', failed.map(([name, n]) => `${inWords(name)} ${count(n)}`).join(', ') || 'none'],
    ['Bytes', `${bytes(line.bytes_in)} in, ${bytes(line.bytes_out)} out, ${bytes(line.stray_bytes)} stray`],
    ...named(labels).map(([title, text]) => [title, text(line)]),
    ...controlLines(line.modem),
    ...(line.services || []).map(service),
    ['Absent devices', line.notice_bound_ms === null ? 'none'
      : `a new answer is noticed within ${ageText(line.notice_bound_ms)}`],
    ['Round trip', `mean ${micros(line.round_trips.mean_us)}, 99 % ${micros(line.round_trips.p99_us)}`],
  ];
}

const useColumns = [
  {title: 'Used by', class: 'name', text: (row) => row.name},
  barred('Part of the time', (row) => [row.share ?? 0, percent(row.share)]),
];

const minuteColumns = [{...useColumns[0], title: 'For'}, useColumns[1]];

const deviceColumns = [
  marked('State', (d) => [d.resting ? 'off' : deviceTrouble(d).shape, stateWord(d)]),
  linked('Device', (d) => [d.name, deviceLink({line: d.line, device: d.name})]),
  {title: 'Address', class: 'num minor', text: (d) => d.address},
  said(),
  aged('Answered', heardAgo),
  counted('Exchanges', (d) => d.exchanges, 'num minor'),
  {title: 'OK', class: 'num', text: (d) => percent(okShare(d))},
  counted('Retries', (d) => d.retries, 'num minor'),
  counted('Missed', (d) => d.missed, 'num minor'),
  {title: 'Mean round trip', class: 'num', text: (d) => micros(d.round_trips.mean_us)},
];

export function line(root, name) {
  const headline = new Headline(name);
  const about = h('p', {class: 'about'});
  const problem = new Problem();
  const advice = new Sentences();
  const figures = new Facts();
  const chart = histogram();
  const use = new WireUse();
  const useTable = new DataTable({columns: useColumns, key: (r) => r.name, caption: 'Use of the wire'});
  const usePart = section('Use of the wire', useTable.element);
  const minute = new DataTable({columns: minuteColumns, key: (r) => r.name, caption: 'Use of the wire in the last minute'});
  const devices = new DataTable({columns: deviceColumns, key: (d) => d.name, caption: `Devices of ${name}`,
    empty: 'This line has no devices: only routes use it.', rowClass: (d) => `rank-${d.resting ? 'off' : deviceTrouble(d).shape}`});
  const trace = new DataTable({columns: exchangeColumns(true), key: (e) => e.key, caption: `Exchanges of ${name}`,
    empty: 'No exchange yet.'});
  const live = liveTrace(name, (list) => trace.paint(list));
  const loan = h('button', {type: 'button', hidden: true, onclick: () => endLoan(name)}, 'End the loan …');
  const seen = h('button', {type: 'button', hidden: true, onclick: () => acknowledgeLine(name)});
  const communication = folded('Communication', figures.element, h('div', {class: 'side-by-side'}, usePart,
      section('Use of the wire in the last minute', minute.element), section('Round trips', chart.element)));
  root.append(crumbs(['Overview', '#/overview']), headline.element, about, problem.element, advice.element,
      h('p', {class: 'controls no-print'}, h('a', {href: alarmsLink({line: name})}, 'Events of this line'), seen, loan),
      section('Devices', devices.element), communication, section('Trace', live.element, trace.element));
  const refresh = () => allAlarms().then((alarms) => {
    const waiting = alarms.filter((alarm) => alarm.line === name && unseen(alarm)).length;
    seen.hidden = !waiting || !may('acknowledge');
    setText(seen, `Acknowledge all alarms of the line (${waiting})`);
  }, () => {});
  refresh();
  get('recorded', {line: name}).then(({records}) => live.begin(exchangesOf(records)), () => {});
  const ends = [live.end, on('alarms', refresh), on('acted', refresh), watchStatus(name, (status) => {
    const mine = status.lines[0];
    const heard = now();
    problem.paint(null);
    headline.paint(lineTrouble(mine).shape, `${name}: ${lineState(mine)}`);
    loan.hidden = mine.port_state !== 'released' || !may('release');
    about.textContent = `${mine.protocol || 'clients'} on ${mine.port}${mine.serial ? `, ${mine.serial}` : ''}`;
    advice.paint(mine.advice.map((text) => ({kind: mine.port_state === 'released' ? 'off' : text.startsWith('note:') ? 'info' : 'warn', text})));
    figures.paint(facts(mine, status.labels.line, status.uptime_ms));
    chart.paint(mine.round_trips);
    useTable.paint(use.take(mine, status.uptime_ms));
    minute.paint(minuteOf(mine, status.uptime_ms));
    setText(usePart.firstChild, `Use of the wire (${use.span})`);
    devices.paint(mine.devices.map((d) => ({...d, line: name, resting: inMaintenance(d, mine), heard,
      advice: mine.port_state === 'open' ? d.advice : []}))
        .sort((a, b) => deviceTrouble(a).rank - deviceTrouble(b).rank));
  }, (error) => problem.paint(error))];
  return () => ends.forEach((end) => end());
}
