// SPDX-License-Identifier: Apache-2.0
// Begins the page: who looks, the frame around the views, and which view is shown.
import {startAlarmBar} from './alarm_bar.js';
import {alarms} from './alarms.js';
import {emit, on} from './bus.js';
import {device} from './device.js';
import {h, setText} from './dom.js';
import {line} from './line.js';
import {showLink, showNotices} from './link_bar.js';
import {parse} from './links.js';
import {overview} from './overview.js';
import {points} from './points.js';
import {startRecorder} from './recorder.js';
import {startSearch} from './search.js';
import {askSession, logOut, session, showLogin} from './session.js';
import {start, stop} from './stream.js';
import {system} from './system.js';
import {trends} from './trends.js';

const views = {overview, device, line, alarms, trends, points, system};
const titles = {overview: 'Overview', alarms: 'Alarms and events', trends: 'Trends', points: 'Points', system: 'System'};
const byId = (id) => document.getElementById(id);
const main = byId('main');
let endView = () => {};
let recording = false;

function show(moved) {
  const {view, thing, parameters} = parse(location.hash);
  endView();
  endView = () => {};
  main.replaceChildren();
  main.className = `view-${view}`;
  for (const link of byId('views').children) {
    const here = link.getAttribute('href') === `#/${view}` || (link.getAttribute('href') === '#/overview'
      && (view === 'device' || view === 'line'));
    if (here) link.setAttribute('aria-current', 'page');
    else link.removeAttribute('aria-current');
  }
  document.title = `${titles[view] || thing || 'baudgate'} – ${session.gateway || 'baudgate'}`;
  if (!views[view]) {
    main.append(h('h1', {tabindex: '-1'}, 'There is no such view'), h('p', {}, h('a', {href: '#/overview'}, 'Overview')));
  } else {
    endView = views[view](main, thing, parameters) || (() => {});
  }
  if (moved && document.activeElement !== byId('query')) main.querySelector('h1')?.focus();
  scrollTo(0, 0);
}

function login() {
  stop();
  endView();
  endView = () => {};
  document.body.dataset.link = 'login';
  byId('alarm-bar').hidden = true;
  byId('logout').hidden = true;
  byId('search').hidden = true;
  showLogin(main, begin);
}

async function begin() {
  try {
    await askSession();
  } catch (error) {
    if (error.status === 401) return login();
    setText(byId('link'), error.message);
    setTimeout(begin, 2000);
    return;
  }
  setText(byId('gateway'), session.gateway || 'baudgate');
  setText(byId('about'), `baudgate ${session.version || ''}`);
  if (session.needs_token && !session.logged_in) return login();
  byId('logout').hidden = !session.needs_token;
  byId('search').hidden = false;
  if (!session.history && !recording) startRecorder();
  recording = true;
  start();
  show(false);
}

startAlarmBar(byId('alarm-bar'));
showLink(byId('link'), byId('lost'));
showNotices(document.body);
startSearch(byId('search'), byId('query'));
byId('skip').addEventListener('click', (event) => {
  event.preventDefault();
  main.focus();
});
byId('logout').addEventListener('click', () => logOut().then(login, (error) => emit('notice', error.message)));
addEventListener('hashchange', () => session.gateway !== undefined && show(true));
on('login', login);
on('reload', () => askSession().catch(() => {}));
begin();
