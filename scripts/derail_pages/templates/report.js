'use strict';
// Charts say the numbers of what is pointed at, tapped, or reached by the arrow keys.
for (const figure of document.querySelectorAll('figure.chart')) {
  const all = [...figure.querySelectorAll('.said')], readout = figure.querySelector('.readout');
  let now = -1;
  const say = k => {
    if (now >= 0) all[now].classList.remove('now');
    now = k;
    readout.textContent = k < 0 ? '\u00a0' : all[k].dataset.says;
    if (k >= 0) all[k].classList.add('now');
  };
  if (all.length === 0) continue;
  figure.addEventListener('pointerover', e => { const at = e.target.closest('.said'); if (at) say(all.indexOf(at)); });
  figure.addEventListener('keydown', e => {
    const way = {ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1}[e.key];
    if (!way) return;
    e.preventDefault();
    say(Math.min(all.length - 1, Math.max(0, now + way)));
  });
}
document.documentElement.dataset.ready = String(Math.round(performance.now()));
