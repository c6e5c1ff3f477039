// SPDX-License-Identifier: Apache-2.0
// The live trace of a line. It has its own stream, which is open only while the trace runs.
import {address} from './api.js';
import {h, setText} from './dom.js';
import {ExchangeReader} from './exchanges.js';

const most = 100;

/** Calls show(exchanges) with the latest exchanges, the newest first. */
export function liveTrace(line, show) {
  let list = [];
  let source = null;
  let reader = null;
  let asked = 0;
  const paint = () => {
    asked = 0;
    show([...list].reverse());
  };
  const soon = () => asked ||= requestAnimationFrame(paint);
  const button = h('button', {type: 'button', 'aria-pressed': 'false', onclick: () => (source ? stop() : start())});
  const state = h('span', {class: 'about'});
  const say = () => {
    setText(button, source ? 'Stop the live trace' : 'Start the live trace');
    button.setAttribute('aria-pressed', String(Boolean(source)));
    setText(state, source ? 'Live.' : 'The last recorded exchanges of the line.');
  };
  function stop() {
    source?.close();
    source = null;
    say();
  }
  function start() {
    reader = new ExchangeReader();
    list = [];
    source = new EventSource(address('trace', {line}));
    source.addEventListener('record', (message) => {
      const exchange = reader.take(JSON.parse(message.data).record);
      if (!exchange) return;
      list.push(exchange);
      if (list.length > most) list.splice(0, list.length - most);
      soon();
    });
    source.addEventListener('error', stop);
    say();
  }
  const hidden = () => document.hidden && stop();
  document.addEventListener('visibilitychange', hidden);
  say();
  return {
    element: h('p', {class: 'controls no-print'}, button, state),
    begin(recorded) {
      if (source) return;
      list = recorded.slice(-most);
      paint();
    },
    end() {
      document.removeEventListener('visibilitychange', hidden);
      stop();
    },
  };
}
