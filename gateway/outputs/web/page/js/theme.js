// SPDX-License-Identifier: Apache-2.0
// Light or dark, by the system's setting or the user's choice. Runs before the first paint.
(() => {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const chosen = () => {
    try {
      return localStorage.getItem('theme') || 'auto';
    } catch {
      return 'auto';
    }
  };
  const apply = () => {
    const theme = chosen() === 'auto' ? (dark.matches ? 'dark' : 'light') : chosen();
    document.documentElement.dataset.theme = theme;
    dispatchEvent(new Event('theme'));
  };
  dark.addEventListener('change', apply);
  apply();
  addEventListener('DOMContentLoaded', () => {
    const select = document.getElementById('theme');
    select.value = chosen();
    select.addEventListener('change', () => {
      try {
        localStorage.setItem('theme', select.value);
      } catch {
        // Without storage, the browser forgets the choice when the page is closed.
      }
      apply();
    });
  });
})();
