// SPDX-License-Identifier: Apache-2.0
// Asks for the status again and again while a view shows it.
import {get} from './api.js';
import {on} from './bus.js';
import {heardTime} from './clock.js';

const periodMs = 2000;
const patienceMs = 10000;  // an answer that has not come by then may never come

/** use(status) every two seconds, or less often where the answer takes long; fail(error). Returns what ends it. */
export function watchStatus(target, use, fail) {
  return repeat(async () => {
    const status = await get('status', {target}, patienceMs);
    heardTime(Date.parse(status.time));
    return status;
  }, use, fail, periodMs);
}

/**
 * Answers that always take long are asked for less often. One slow answer among fast ones changes nothing: the gateway was
 * stopped for a while. What was answered while the link was lost is asked for once more.
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
