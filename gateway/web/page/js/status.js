// SPDX-License-Identifier: Apache-2.0
// Asks for the status again and again while a view shows it.
import {get} from './api.js';
import {on} from './bus.js';
import {heardTime} from './clock.js';

const periodMs = 2000;

/** use(status) every two seconds, or less often where the answer takes long; fail(error). Returns what ends it. */
export function watchStatus(target, use, fail) {
  return repeat(async () => {
    const status = await get('status', {target});
    heardTime(Date.parse(status.time));
    return status;
  }, use, fail, periodMs);
}

export function repeat(ask, use, fail, period) {
  let timer = 0;
  let ended = false;
  let asking = false;
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
    if (!ended) timer = setTimeout(round, Math.max(period, 20 * (performance.now() - begin)));
  };
  const stops = [on('link', ({state}) => state === 'live' && round())];
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
