// SPDX-License-Identifier: Apache-2.0
// Requests the status periodically while a view shows it.
import {get} from './api.js';
import {on} from './bus.js';
import {heardTime} from './clock.js';

const periodMs = 2000;
const patienceMs = 10000;  // timeout, because an answer may never come

/**
 * Requests the status every two seconds, or less often if answers are slow. Calls use(status), or fail(error). Returns the
 * function that ends the requests.
 */
export function watchStatus(target, use, fail) {
  return repeat(async () => {
    const status = await get('status', {target}, patienceMs);
    heardTime(Date.parse(status.time));
    return status;
  }, use, fail, periodMs);
}

/**
 * Calls `ask` every `period` ms, but less often if two answers in a row are slow. One slow answer changes nothing, because
 * the gateway may have been paused. If the connection returns during a request, the request is repeated at once.
 */
export function repeat(ask, use, fail, period) {
  let timer = 0;
  let ended = false;
  let asking = false;
  let again = false;
  let tookBefore = 0;
  const round = async () => {
    clearTimeout(timer);
    if (ended || asking) return;
    if (document.hidden) {
      timer = setTimeout(round, period);
      return;
    }
    asking = true;
    const begin = performance.now();
    try {
      const answer = await ask();
      if (!ended) use(answer);
    } catch (error) {
      if (!ended) fail(error);
    }
    asking = false;
    const took = performance.now() - begin;
    if (!ended) timer = setTimeout(round, again ? 0 : Math.max(period, 20 * Math.min(took, tookBefore)));
    tookBefore = took;
    again = false;
  };
  const stops = [on('link', ({state}) => {
    if (state !== 'live') return;
    again = asking;
    round();
  }), on('acted', () => {
    again = asking;
    round();
  })];
  const shown = () => document.hidden || round();
  document.addEventListener('visibilitychange', shown);
  round();
  return () => {
    ended = true;
    clearTimeout(timer);
    document.removeEventListener('visibilitychange', shown);
    for (const stop of stops) stop();
  };
}
