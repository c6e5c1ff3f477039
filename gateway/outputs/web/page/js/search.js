// SPDX-License-Identifier: Apache-2.0
// The search box: typing shows the matching lines, devices and points, Enter opens the first, Escape returns to the view before.
import {emit} from './bus.js';
import {parse, pointsLink, replace} from './links.js';

/** The text for which Enter was pressed; the view of points opens the first thing that it finds. */
export const wish = {text: ''};

export function startSearch(form, input) {
  let before = '#/overview';
  let asked = 0;
  const search = () => {
    asked = 0;
    const {view, parameters} = parse(location.hash);
    if (view === 'points') {
      replace(pointsLink({...parameters, q: input.value}));
      emit('search', input.value);
    } else if (input.value) {
      before = location.hash || '#/overview';
      location.hash = pointsLink({q: input.value});
    }
  };
  input.addEventListener('input', () => {
    wish.text = '';
    asked ||= requestAnimationFrame(search);
  });
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    cancelAnimationFrame(asked);
    search();
    wish.text = input.value.trim();
    emit('open');
  });
  input.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape') return;
    event.preventDefault();
    input.value = '';
    input.blur();
    if (parse(location.hash).view === 'points') location.hash = before;
  });
  addEventListener('keydown', (event) => {
    const typing = event.target.closest && event.target.closest('input, select, textarea');
    if (event.key !== '/' || typing || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    input.focus();
  });
  const follow = () => {
    const {view, parameters} = parse(location.hash);
    if (document.activeElement !== input) input.value = view === 'points' ? parameters.q || '' : '';
  };
  addEventListener('hashchange', follow);
  follow();
}
