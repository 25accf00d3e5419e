// Text beside the picture: stages, bodies, notices. All text is text, never HTML.
import { ROLE } from './stream.js';

const $ = (id) => document.getElementById(id);
const number = (x, digits = 3) => (typeof x === 'number' && isFinite(x) ? Number(x.toPrecision(digits)).toString() : '-');
const ms = (x) => x.toFixed(x < 100 ? 1 : 0);

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) key === 'class' ? made.className = value : made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export class Panels {
  constructor() {
    this.curves = new Map();
    this.stageRows = new Map();
  }

  setting(json) {
    $('scene').textContent = json.scene;
    document.title = `${json.scene} - Tactus`;
    const facts = [['machine', json.machine], ['devices', json.devices], ['commit', json.commit]].filter(([, value]) => value);
    $('facts').replaceChildren(...facts.flatMap(([key, value]) => [element('dt', {}, key), element('dd', {}, value)]));
  }

  // ages: from the capture of images to their drawn picture, of the newest frames [ms].
  age(ages) {
    const sorted = [...ages].sort((a, b) => a - b), at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
    $('age').textContent = sorted.length ? `Capture to canvas: p50 ${ms(at(0.5))} ms, p99 ${ms(at(0.99))} ms` : '';
  }

  state(state) {
    $('state').textContent = state;
    $('state').className = `chip ${state}`;
  }

  time(message, total, more = '') {
    $('time').textContent = `${message.time_s.toFixed(2)} s, frame ${message.frame}${total ? ` / ${total}` : ''}${more}`;
  }

  status(json) {
    this.stages(json.stages ?? [], json.budget_ms);
    this.bodies(json.bodies ?? [], json.liquid);
    this.notices(json.notices ?? []);
  }

  // The longest twelve. The width is a quarter more than the budget, or the longest median: what is longer ends there.
  stages(stages, budget) {
    const whole = stages.find((s) => s.name === 'frame'), rest = stages.filter((s) => s !== whole);
    rest.sort((a, b) => b.p50_ms - a.p50_ms || a.name.localeCompare(b.name));
    const shown = [...(whole ? [whole] : []), ...rest.slice(0, 11)];
    const width = Math.max(1e-3, budget ? 1.25 * budget : 2 * (whole?.p50_ms ?? 0), ...shown.map((s) => s.p50_ms)), percent = (x) => Math.min(100, 100 * x / width);
    const over = (s) => (!budget ? '' : s.p50_ms > budget ? 'over' : s.p99_ms > budget ? 'p99 over' : '');
    $('budget').textContent = budget && whole ? `Budget ${ms(budget)} ms: ${over(whole) ? `${over(whole) === 'over' ? 'median' : 'p99'} over by ${ms((over(whole) === 'over' ? whole.p50_ms : whole.p99_ms) - budget)} ms` : 'kept'}` : '';
    $('stages').replaceChildren(...shown.map((s) => {
      const fill = element('div', { class: 'fill' }), mark = element('div', { class: 'mark' });
      fill.style.width = `${percent(s.p50_ms)}%`;
      mark.style.left = `calc(${percent(s.p99_ms)}% - 2px)`;
      const track = element('div', { class: 'track' }, fill, mark);
      if (budget) {
        const limit = element('div', { class: 'limit' });
        limit.style.left = `calc(${percent(budget)}% - 1px)`;
        track.append(limit);
      }
      return element('div', { class: 'stage', title: s.name }, element('span', { class: 'name' }, s.name), track,
        element('span', { class: 'ms' }, ms(s.p50_ms)), element('span', { class: 'ms' }, ms(s.p99_ms)), element('span', { class: 'over' }, over(s)));
    }));
  }

  bodies(bodies, liquid) {
    const rows = (entries) => entries.map(([key, value]) => element('tr', {}, element('th', {}, key), element('td', {}, value)));
    const made = bodies.map((b) => element('div', {},
      element('table', {}, element('caption', {}, b.name + (b.diverged ? ' (diverged)' : '')), ...rows([
        ['force', `${number(b.force_N)} N`], ['smallest J', number(b.min_J)], ['volume', `${number(b.volume_ml, 4)} ml`], ['elastic energy', `${number(b.elastic_J)} J`]])),
      this.curve(b.name, b.force_N)));
    if (liquid) made.push(element('table', {}, element('caption', {}, 'liquid'), ...rows([['particles', String(liquid.particles)]])));
    $('bodies').replaceChildren(...made);
  }

  // The force over the last 240 statuses, or what `series` knows.
  curve(name, value) {
    let curve = this.curves.get(name);
    if (!curve) this.curves.set(name, curve = { canvas: element('canvas', { class: 'curve', width: 416, height: 68, 'aria-label': `force on ${name}` }), values: [] });
    if (this.series) curve.values = this.series(name);
    else curve.values.push(isFinite(value) ? value : 0);
    if (curve.values.length > 240) curve.values.shift();
    const c = curve.canvas.getContext('2d'), { width, height } = curve.canvas, most = Math.max(1e-6, ...curve.values);
    c.clearRect(0, 0, width, height);
    c.strokeStyle = '#c6ccd3';
    c.strokeRect(1, 1, width - 2, height - 2);
    c.strokeStyle = '#0072b2';
    c.lineWidth = 3;
    c.beginPath();
    curve.values.forEach((x, i) => c.lineTo(4 + i * (width - 8) / 239, height - 5 - (height - 26) * x / most));
    c.stroke();
    c.fillStyle = '#4b5560';
    c.font = '20px system-ui, "DejaVu Sans", sans-serif';
    c.fillText(most > 1e-6 ? `force, at most ${number(most, 2)} N` : 'no force', 8, 20);
    return curve.canvas;
  }

  notices(notices) {
    const text = (n) => `${n.severity === 'info' ? '' : `${n.severity}: `}${n.text}${n.remedy ? `: ${n.remedy}` : ''}`;
    $('notices').replaceChildren(...notices.slice(-3).map((n) => element('li', { class: n.severity }, text(n))));
  }

  say(text, severity = 'warning') {
    $('notices').prepend(element('li', { class: severity }, text));
  }

  help(rows) {
    $('help').replaceChildren(element('h2', {}, 'Keys and mouse'),
      element('table', {}, ...rows.map(([keys, what]) => element('tr', {}, element('th', {}, element('kbd', {}, keys)), element('td', {}, what)))));
  }
}

export const kHelp = [['left drag', 'turn'], ['right drag, shift drag', 'move'], ['wheel', 'nearer, farther'], ['r', 'whole scene'], ['c', 'cameras'],
  ['f', 'panels'], ['h', 'this help']];

// Buttons of the bar and their keys.
export function addButtons(viewer, actions) {
  const bar = $('bar'), keys = new Map();
  for (const { key, label, action, title, pressed } of actions) {
    const button = element('button', { type: 'button', title: title ?? `key ${key === ' ' ? 'space' : key}` }, label);
    if (pressed !== undefined) button.setAttribute('aria-pressed', pressed);
    button.addEventListener('click', () => { action(button); viewer.canvas.focus(); });
    keys.set(key, button);
    bar.append(button);
  }
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'INPUT' || event.target.tagName === 'BUTTON' && event.key === ' ') return;
    const button = keys.get(event.key);
    if (!button || button.disabled) return;
    event.preventDefault();
    button.click();
  });
  return keys;
}

export function viewActions(viewer) {
  const toggle = (button) => {
    const pressed = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', pressed);
    return pressed;
  };
  return [
    { key: 'r', label: 'Whole scene', action: () => viewer.fit() },
    { key: 'c', label: 'Cameras', pressed: !viewer.hidden.has(ROLE.camera), action: (b) => viewer.hide(ROLE.camera, !toggle(b)) },
    { key: 'f', label: 'Panels', pressed: true, action: (b) => { const on = toggle(b); for (const id of ['run', 'side']) $(id).style.display = on ? '' : 'none'; } },
    { key: 'h', label: 'Help', pressed: false, action: (b) => { $('help').hidden = !toggle(b); } },
  ];
}

// The ends of a slider: those of the parameter, or a thirtieth to thirty times its value where they are far away.
export function sliderOf(parameter) {
  const { value, least, most } = parameter, isOpen = least === null || most === null;
  if (value > 0 && least !== null && least >= 0 && (isOpen || most > 100 * value)) {
    const low = Math.log10(Math.max(value / 30, least || 0)), high = Math.log10(Math.min(value * 30, most ?? Infinity));
    return { low, high, from: Math.log10, to: (x) => Number((10 ** x).toPrecision(3)) };
  }
  const reach = 2 * Math.abs(value) + 1;
  return { low: Math.max(least ?? -Infinity, isOpen || most - least > 1000 * reach ? value - reach : -Infinity),
    high: Math.min(most ?? Infinity, isOpen || most - least > 1000 * reach ? value + reach : Infinity), from: (x) => x, to: (x) => Number(x.toPrecision(3)) };
}

export function addSliders(parameters, set) {
  if (!parameters.length) return null;
  const sliders = new Map(), shown = (p, value) => `${Number(value.toPrecision(3))}${p.unit ? ` ${p.unit}` : ''}`;
  $('parameters').replaceChildren(element('h2', {}, 'Parameters'), ...parameters.map((p) => {
    const scale = sliderOf(p), text = element('span', {}, shown(p, p.value));
    const input = element('input', { type: 'range', min: scale.low, max: scale.high, step: (scale.high - scale.low) / 200, value: scale.from(p.value), 'aria-label': p.name });
    input.addEventListener('input', () => {
      const value = scale.to(Number(input.value));
      text.textContent = shown(p, value);
      set(p.name, value);
    });
    sliders.set(p.name, { input, show: (value) => { if (document.activeElement !== input) { input.value = scale.from(value); text.textContent = shown(p, value); } } });
    const short = p.name.replace(/^bodies\.([^.]+)\.(material\.)?/, '$1: ').replace(/_(pa|per_s|m_s2|m_s)(\.|$)/, '$2').replaceAll('_', ' ');
    return element('label', { class: 'parameter', title: p.meaning || p.name }, element('span', {}, element('span', {}, short), text), input);
  }));
  return { take: (values) => { for (const [name, slider] of sliders) if (values[name] !== undefined) slider.show(values[name]); } };
}
