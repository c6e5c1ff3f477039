// SPDX-License-Identifier: Apache-2.0
// The session of the user and its permissions; the login form.
import {get, post} from './api.js';
import {h, setText} from './dom.js';

export const session = {
  needs_token: false, users: false, logged_in: false, user: '', role: '', acknowledge: false, write: false, history: false,
  events: false,
};

export async function askSession() {
  Object.assign(session, await get('session'));
  return session;
}

export const logOut = () => post('logout');

/**
 * Shows the login form; calls done() when the gateway has accepted the login. A gateway with users asks for a user and a
 * password; without a user the password field takes a token.
 */
export function showLogin(main, done) {
  const problem = h('p', {class: 'problem', role: 'alert', hidden: true});
  const user = h('input', {id: 'user', autocomplete: 'username', autocapitalize: 'none', spellcheck: 'false'});
  const secret = h('input', {id: 'token', type: 'password', autocomplete: 'current-password', required: true});
  const named = session.users
    ? [h('label', {for: 'user'}, 'User (empty for a token)'), user, h('label', {for: 'token'}, 'Password or token')]
    : [h('label', {for: 'token'}, 'Token of this gateway')];
  const from = session.users
    ? ['Whoever runs the gateway makes users there: ', h('code', {}, 'baudgate users add NAME --role operator')]
    : ['The token is the first line of the file that ', h('code', {}, 'web: { token: { file: … } }'), ' of the configuration names, often ',
      h('code', {}, 'web.token'), '. Whoever runs the gateway can read it there.'];
  const form = h('form', {class: 'login'}, h('h1', {}, `Log in${session.gateway ? ` to ${session.gateway}` : ''}`), ...named, secret,
      h('button', {type: 'submit', class: 'strong'}, 'Log in'), problem, h('p', {class: 'about'}, from));
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const name = user.value.trim();
    try {
      await post('login', name ? {user: name, password: secret.value} : {token: secret.value});
      done();
    } catch (error) {
      problem.hidden = false;
      setText(problem, error.message);
      secret.select();
    }
  });
  main.replaceChildren(form);
  (session.users ? user : secret).focus();
}

const IDLE = 30 * 60 * 1000;
let idle = 0;

/** Logs a user who may operate out when nobody has used the mouse or the keyboard for half an hour. */
export function lockWhenIdle(lock) {
  const wait = () => {
    clearTimeout(idle);
    if (session.role === 'operator' || session.role === 'engineer') idle = setTimeout(lock, IDLE);
  };
  for (const event of ['pointerdown', 'keydown']) addEventListener(event, wait, {passive: true});
  wait();
}
