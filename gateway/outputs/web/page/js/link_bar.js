// SPDX-License-Identifier: Apache-2.0
// Shows whether the gateway can be reached, and short notices.
import {on} from './bus.js';
import {age, now, setAge} from './clock.js';
import {h, setText} from './dom.js';
import {askSession} from './session.js';

const words = {starting: 'connecting', live: 'live', lost: 'connection lost', paused: 'paused'};

export function showLink(word, banner) {
  const silent = age();
  // The age advances on the screen; a screen reader reads the sentence once.
  silent.setAttribute('aria-hidden', 'true');
  banner.append(h('strong', {}, 'Connection to the gateway lost. '), 'The values below are old: no data for ',
      silent, '. The page reconnects by itself.');
  on('link', ({state, since}) => {
    document.body.dataset.link = state;
    setText(word, words[state]);
    banner.hidden = state !== 'lost';
    if (state === 'lost') {
      setAge(silent, now() - (Date.now() - since));
      // The stream cannot tell a lost connection from a session that has ended. The answer to this request can, and
      // then the login form is shown.
      askSession().then((s) => s.needs_token && !s.logged_in && location.reload(), () => {});
    }
  });
}

export function showNotices(body) {
  const text = h('span');
  const box = h('div', {class: 'notice', role: 'alert', hidden: true}, text,
      h('button', {type: 'button', class: 'small', onclick: () => hide()}, 'Close'));
  let timer = 0;
  const hide = () => {
    box.hidden = true;
  };
  body.append(box);
  on('notice', (sentence) => {
    clearTimeout(timer);
    setText(text, sentence);
    box.hidden = false;
    timer = setTimeout(hide, 12000);
  });
}
