// SPDX-License-Identifier: Apache-2.0
// Starts the page: login, the frame around the views, and the view that is shown.
import {startAlarmBar} from './alarm_bar.js';
import {emit, on} from './bus.js';
import {h, setText} from './dom.js';
import * as favourites from './favourites.js';
import {showLink, showNotices} from './link_bar.js';
import {parse} from './links.js';
import {may} from './operate.js';
import {startSearch} from './search.js';
import {askSession, lockWhenIdle, logOut, session, showLogin} from './session.js';
import {start, stop} from './stream.js';
import {isUtc, setUtc} from './zone.js';

/**
 * Each view's title (empty: not in the list on top) and module. The module's function with the name of the view shows the
 * view, and returns the function that ends the view.
 */
const views = {
  favourites: ['Favourites', () => import('./favourites.js')],
  overview: ['Overview', () => import('./overview.js')],
  device: ['', () => import('./device.js')],
  line: ['', () => import('./line.js')],
  alarms: ['Alarms and events', () => import('./alarms.js')],
  trends: ['Trends', () => import('./trends.js')],
  points: ['Points', () => import('./points.js')],
  writes: ['Writes', () => import('./writes.js')],
  system: ['System', () => import('./system.js')],
};
const byId = (id) => document.getElementById(id);
const main = byId('main');
let endView = () => {};
let current = null;  // {view, thing, moved} of a view that follows its address by itself
let begun = false;
let shown = 0;
let name = '';
let waiting = 0;

function paintTitle() {
  document.title = `${waiting ? `(${waiting}) ` : ''}${name} – ${session.gateway || 'baudgate'}`;
}

/** The view that the address names; without a name the favourites, if there are any. */
function addressed() {
  const found = parse(location.hash);
  return found.view ? found : {...found, view: favourites.list().length ? 'favourites' : 'overview'};
}

const menu = byId('menu');
function closeMenu() {
  menu.setAttribute('aria-expanded', 'false');
}

async function show(moved) {
  const {view, thing, parameters} = addressed();
  closeMenu();
  if (current && moved && current.view === view && current.thing === thing) return current.moved(parameters);
  current = null;
  const mine = ++shown;
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
  name = views[view]?.[0] || thing || 'baudgate';
  paintTitle();
  if (!Object.hasOwn(views, view)) {
    main.append(h('h1', {tabindex: '-1'}, 'This page has no such view: use a link of the menu'), h('p', {}, h('a', {href: '#/overview'}, 'Overview')));
  } else {
    const module = await views[view][1]().catch(() => null);
    if (mine !== shown) return;
    if (!module) return emit('notice', 'A part of the page cannot be loaded: reload the page.');
    const made = module[view](main, thing, parameters);
    endView = made.end || made;
    if (made.moved) current = {view, thing, moved: made.moved};
  }
  if (moved && document.activeElement !== byId('query')) main.querySelector('h1')?.focus();
  scrollTo(0, 0);
}

function login() {
  ++shown;
  stop();
  endView();
  endView = () => {};
  current = null;
  document.body.dataset.link = 'login';
  byId('alarm-bar').hidden = true;
  byId('logout').hidden = byId('who').hidden = true;
  byId('search').hidden = true;
  waiting = 0;
  name = 'Log in';
  paintTitle();
  showLogin(main, begin);
}

/**
 * Runs once per page: loads what is needed only after login, and the modules of all views, so that they work without a
 * connection.
 */
function beginOnce() {
  if (begun) return;
  begun = true;
  lockWhenIdle(end);
  if (!session.history) import('./recorder.js').then(({startRecorder}) => startRecorder(), () => {});
  setTimeout(() => Object.values(views).forEach(([, load]) => load().catch(() => {})), 1500);
}

async function begin() {
  const {view} = addressed();
  if (Object.hasOwn(views, view)) views[view][1]().catch(() => {});
  try {
    await askSession();
  } catch (error) {
    if (error.status === 401) return login();
    setText(byId('link'), error.message);
    setTimeout(begin, 2000);
    return;
  }
  setText(byId('gateway'), session.gateway || 'baudgate');
  setText(byId('about'), session.version ? `baudgate ${session.version}.` : '');
  byId('views').querySelector("a[href='#/writes']").hidden = !may('writes');
  if (session.needs_token && !session.logged_in) return login();
  byId('logout').hidden = !session.needs_token;
  setText(byId('who'), session.user ? `${session.user}, ${session.role}` : '');
  byId('who').hidden = !session.user;
  byId('search').hidden = false;
  show(false);
  start();
  beginOnce();
}

addEventListener('keydown', (event) => {
  if (event.key !== 'Escape' || menu.getAttribute('aria-expanded') !== 'true') return;
  closeMenu();
  menu.focus();
});
menu.addEventListener('click', () => menu.setAttribute('aria-expanded', String(menu.getAttribute('aria-expanded') !== 'true')));
const zone = byId('zone');
const local = new Intl.DateTimeFormat().resolvedOptions().timeZone || 'local';
zone.append(h('option', {value: 'local', selected: !isUtc()}, 'Local time'), h('option', {value: 'utc', selected: isUtc()}, 'UTC'));
zone.addEventListener('change', () => setUtc(zone.value === 'utc'));
const sayZone = () => setText(byId('zone-said'), isUtc() ? 'All times are UTC.' : `All times are local times of this browser (${local}).`);
sayZone();
byId('views').append(...Object.entries(views).filter(([, [title]]) => title).map(([name, [title]]) => h('a', {href: `#/${name}`}, title)));
startAlarmBar(byId('alarm-bar'));
showLink(byId('link'), byId('lost'));
showNotices(document.body);
startSearch(byId('search'), byId('query'));
byId('skip').addEventListener('click', (event) => {
  event.preventDefault();
  main.focus();
});
const end = () => logOut().then(login, (error) => emit('notice', error.message));
byId('logout').addEventListener('click', end);
const paintFavourites = () => {
  byId('views').firstChild.hidden = !favourites.list().length;
};
paintFavourites();
on('favourites', paintFavourites);
addEventListener('hashchange', () => session.gateway !== undefined && show(true));
on('login', login);
on('zone', () => {
  sayZone();
  show(false);
});
on('unacknowledged', (n) => {
  waiting = n;
  paintTitle();
});
on('reload', () => askSession().catch(() => {}));
on('link', async ({state, before}) => {
  if (state !== 'live' || before !== 'lost') return;
  const {version} = session;
  await askSession().catch(() => {});
  // Another version of the gateway has another page, which must be loaded.
  if (session.version !== version) location.reload();
});

begin();
