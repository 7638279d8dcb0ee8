'use strict';
// What draws on a canvas. Pictures that are kept by the processor: drawn without a graphics card they are much faster, and they are small.
const pen = canvas => canvas.getContext('2d', {willReadFrequently: true});
// Charts on a canvas: lines and bars over one axis, with the values under the pointer (or moved by the arrow keys).
class Chart {
  // readout(x) returns the words for the place x, pick(x) is called where it is clicked.
  constructor(canvas, readout, {readoutFor, pick} = {}) {
    Object.assign(this, {canvas, readout, readoutFor, pick, at: null, head: document.createElement('div')});
    this.head.className = 'head';
    canvas.after(this.head);
    const place = e => {
      const box = canvas.getBoundingClientRect();
      this.at = this.toX(e.clientX - box.left);
      this.say();
    };
    canvas.addEventListener('pointermove', place);
    canvas.addEventListener('pointerleave', () => { this.at = null; this.say(); });
    canvas.addEventListener('keydown', e => {
      const way = {ArrowLeft: -1, ArrowRight: 1}[e.key];
      if (e.key === 'Escape' && this.at !== null) this.at = null;
      else if (e.key === 'Enter' && pick && this.at !== null) pick(this.at);
      else if (way && this.spec) {
        const {x0, x1, step} = this.spec, by = (step || (x1 - x0) / 100) * way;
        this.at = Math.min(x1, Math.max(x0, this.at === null ? (way > 0 ? x0 : x1) : this.at + by));
      } else return;
      e.preventDefault();
      this.say();
    });
    canvas.addEventListener('blur', () => { this.at = null; this.say(); });
    canvas.addEventListener('click', e => { place(e); if (pick && this.at !== null) pick(this.at); });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }
  say() {
    this.readout.textContent = this.at === null || !this.spec ? '\u00a0' : this.readoutFor(this.at);
    this.draw();
  }
  toX(px) {
    const {x0, x1} = this.spec || {x0: 0, x1: 1}, f = (px - this.left) / Math.max(1, this.width - this.left - 8);
    return x0 + (x1 - x0) * Math.min(1, Math.max(0, f));
  }
  // spec: x0, x1, xTitle, yTitle, lines: [{x, y, colour, width, dash, name}], bars: {y, colours}, step: of the arrow keys
  set(spec) { this.spec = spec; this.draw(); if (this.at !== null) this.readout.textContent = this.readoutFor(this.at); }
  // Moves the line at what is shown, and nothing else; undefined: there is none.
  mark(x, colour) {
    this.marked = x;
    this.head.style.background = colour;
    this.placeHead();
    if (this.at !== null) this.readout.textContent = this.readoutFor(this.at);
  }
  placeHead() {
    const {spec, marked, left, width} = this;
    this.head.hidden = !spec || marked === undefined || !(width > 0);
    if (this.head.hidden) return;
    const px = left + (marked - spec.x0) / (spec.x1 - spec.x0) * (width - left - 8);
    this.head.style.transform = `translateX(${px - 0.75}px)`;
  }
  static ticks(from, to, count) {
    const raw = (to - from) / count, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].find(s => s * power >= raw) * power;
    const all = [];
    for (let v = Math.ceil(from / step - 1e-9) * step; v <= to + 1e-9 * step; v += step) all.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return all;
  }
  draw() {
    const {canvas, spec} = this, ratio = window.devicePixelRatio || 1;
    const width = this.width = canvas.clientWidth, height = canvas.clientHeight;
    if (!spec || width === 0) return;
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    const c = pen(canvas);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = '12px system-ui, sans-serif';
    let low = 0, high = 0;
    for (const line of spec.lines || []) for (const v of line.y) { if (v < low) low = v; if (v > high) high = v; }
    for (const v of spec.bars ? spec.bars.y : []) { if (v < low) low = v; if (v > high) high = v; }
    if (spec.yRange) { low = Math.min(low, spec.yRange[0]); high = Math.max(high, spec.yRange[1]); }
    if (high === low) high = low + 1;
    const pad = 0.04 * (high - low);
    if (low < 0) low -= pad;
    high += pad;
    const yTicks = Chart.ticks(low, high, 5);
    const left = this.left = 10 + Math.max(...yTicks.map(t => c.measureText(Chart.number(t)).width));
    const top = 18, bottom = height - 32;
    const px = x => left + (x - spec.x0) / (spec.x1 - spec.x0) * (width - left - 8);
    const py = y => bottom - (y - low) / (high - low) * (bottom - top);
    c.fillStyle = '#555b66';
    c.strokeStyle = '#dfe3e8';
    c.lineWidth = 1;
    c.textAlign = 'right';
    c.textBaseline = 'middle';
    for (const t of yTicks) {
      c.beginPath(); c.moveTo(left, py(t)); c.lineTo(width - 8, py(t)); c.stroke();
      c.fillText(Chart.number(t), left - 5, py(t));
    }
    c.textAlign = 'center';
    c.textBaseline = 'top';
    for (const t of Chart.ticks(spec.x0, spec.x1, Math.max(2, width / 90))) {
      c.beginPath(); c.moveTo(px(t), bottom); c.lineTo(px(t), bottom + 4); c.stroke();
      c.fillText(Chart.number(t), px(t), bottom + 5);
    }
    c.fillText(spec.xTitle, (left + width) / 2, bottom + 18);
    c.textAlign = 'left';
    c.fillText(spec.yTitle, 0, 0);
    c.strokeStyle = '#555b66';
    c.beginPath(); c.moveTo(left, py(0)); c.lineTo(width - 8, py(0)); c.stroke();
    if (spec.bars) {
      const {x, y, colours} = spec.bars, w = Math.max(1, (width - left - 8) / (spec.x1 - spec.x0) * 0.8);
      for (let i = 0; i < y.length; ++i) {
        if (y[i] === 0) continue;
        c.fillStyle = colours[i];
        c.fillRect(px(x[i]) - w / 2, Math.min(py(0), py(y[i])), w, Math.max(1, Math.abs(py(y[i]) - py(0))));
        if (w > 4) { c.strokeStyle = '#333'; c.lineWidth = 0.5; c.strokeRect(px(x[i]) - w / 2, Math.min(py(0), py(y[i])), w, Math.abs(py(y[i]) - py(0))); }
      }
    }
    for (const line of spec.lines || []) {
      c.strokeStyle = line.colour;
      c.lineWidth = line.width || 1.5;
      c.setLineDash(line.dash || []);
      c.beginPath();
      for (let i = 0; i < line.y.length; ++i) c.lineTo(px(line.x[i]), py(line.y[i]));
      c.stroke();
      c.setLineDash([]);
    }
    c.textAlign = 'right';
    c.textBaseline = 'top';
    let right = width - 8;
    for (const line of [...(spec.lines || [])].reverse()) {
      if (!line.name) continue;
      c.fillStyle = '#1a1c20';
      c.fillText(line.name, right, 1);
      right -= c.measureText(line.name).width + 4;
      c.strokeStyle = line.colour; c.lineWidth = 2.5; c.setLineDash(line.dash || []);
      c.beginPath(); c.moveTo(right - 22, 8); c.lineTo(right, 8); c.stroke(); c.setLineDash([]);
      right -= 34;
    }
    const rule = (x, colour) => { c.strokeStyle = colour; c.lineWidth = 1.5; c.beginPath(); c.moveTo(px(x), top); c.lineTo(px(x), bottom); c.stroke(); };
    this.placeHead();
    if (this.at !== null) rule(this.at, '#1a1c20');
  }
  static number(v) { return Math.abs(v) >= 10000 ? v.toExponential(0) : String(+v.toPrecision(6)).replace('-', '\u2212'); }
}
