// SPDX-License-Identifier: Apache-2.0
// The only event stream of the page: it feeds the store and shows whether the gateway can be reached.
import {emit} from './bus.js';
import {heardTime} from './clock.js';
import {take} from './store.js';

const silenceMs = 2500;  // the gateway sends a beat every second
const retryMs = 1000;
const patienceMs = 5000;  // timeout for the first event of a new stream

let source = null;
let wanted = false;
let openedAt = 0;
let heardAt = 0;
let retryAt = 0;
let lostSince = 0;

/** {state: 'starting' | 'live' | 'lost' | 'paused', since: ms of this browser's clock} */
export const link = {state: 'starting', since: 0};

function tell(state) {
  if (link.state === state) return;
  const before = link.state;
  link.state = state;
  link.since = state === 'lost' ? heardAt || openedAt : Date.now();
  emit('link', {state, before, since: link.since});
}

function heard() {
  heardAt = Date.now();
  lostSince = 0;
  tell('live');
}

function close() {
  if (source) source.close();
  source = null;
}

function open() {
  close();
  openedAt = Date.now();
  const mine = new EventSource('api/v1/points/stream');
  source = mine;
  const listen = (event, use) => mine.addEventListener(event, (message) => {
    if (mine !== source) return;
    const data = message.data ? JSON.parse(message.data) : {};
    if (data && data.time_ms) heardTime(data.time_ms);
    heard();
    use(data);
  });
  listen('snapshot', (data) => take(data, true));
  listen('change', (data) => take(data, false));
  listen('alarms', (data) => emit('alarms', data));
  listen('beat', () => {});
  listen('reload', () => {
    close();
    retryAt = Date.now() + 200;
    emit('reload');
  });
  mine.addEventListener('error', () => {
    if (mine !== source) return;
    close();
    retryAt = Date.now() + retryMs;
  });
}

function watch() {
  if (!wanted || document.hidden) return;
  const at = Date.now();
  if (!source && at >= retryAt) open();
  const since = Math.max(heardAt, link.state === 'starting' || link.state === 'paused' ? openedAt : 0);
  if (at - since > silenceMs) {
    if (!lostSince) lostSince = at;
    tell('lost');
    if (source && at - Math.max(openedAt, heardAt) > patienceMs) open();
  }
}

export function start() {
  if (wanted) return;
  wanted = true;
  open();
}

export function stop() {
  wanted = false;
  close();
  link.state = 'starting';
}

setInterval(watch, 250);
document.addEventListener('visibilitychange', () => {
  if (!wanted) return;
  if (document.hidden) {
    close();
    tell('paused');
  } else {
    open();
  }
});
