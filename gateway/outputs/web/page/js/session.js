// SPDX-License-Identifier: Apache-2.0
// The session of the user and its permissions; the login form.
import {get, post} from './api.js';
import {h, setText} from './dom.js';

export const session = {needs_token: false, logged_in: false, acknowledge: false, history: false, events: false};

export async function askSession() {
  Object.assign(session, await get('session'));
  return session;
}

export const logOut = () => post('logout');

/** Shows the login form; calls done() when the gateway has accepted the token. */
export function showLogin(main, done) {
  const problem = h('p', {class: 'problem', role: 'alert', hidden: true});
  const token = h('input', {id: 'token', type: 'password', autocomplete: 'current-password', required: true});
  const form = h('form', {class: 'login'}, h('h1', {}, 'Log in'),
      h('label', {for: 'token'}, 'Token of this gateway (in the file that web.token names)'), token, h('button', {type: 'submit'}, 'Log in'), problem);
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    try {
      await post('login', {token: token.value});
      done();
    } catch (error) {
      problem.hidden = false;
      setText(problem, error.message);
      token.select();
    }
  });
  main.replaceChildren(form);
  token.focus();
}
